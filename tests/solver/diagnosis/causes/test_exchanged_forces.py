"""Forces of two plates in each other's place, and forces along wrong axes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.capture.formats.storage import Storage
from solver.capture.plates.moment_convention import plates_from_storage
from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.exchanged_forces import AxisConvention, PlateExchange, PlateSwap


def columns_of(plate):
    point = np.nan_to_num(plate.cop_ground)
    return plate.force_ground, point, plate.moment_ground - np.cross(point, plate.force_ground)


def read_again(capture, columns):
    """The plates that a reader makes of these columns: force, centre of pressure, free moment."""
    labels = [
        f"ground_force_{k + 1}_{kind}{axis}" for k in range(len(columns)) for kind in "vpm" for axis in "xyz"
    ]
    values = np.concatenate([column for plate in columns for column in plate], axis=1)
    times = capture.plates[0].times
    lines = tuple(range(1, len(times) + 1))
    storage = Storage(Path("grf.mot"), tuple(labels), times, values, capture.plates[0].rate, lines=lines)
    plates, _ = plates_from_storage(storage)
    cornered = zip(plates, capture.plates, strict=True)
    return replace(
        capture, plates=tuple(replace(p, corners_ground=known.corners_ground) for p, known in cornered)
    )


@pytest.mark.parametrize("free_moments_go_along", [True, False])
@pytest.mark.parametrize(("a", "b"), [(1, 2), (0, 2), (1, 3)], ids=["overlapping", "apart", "same foot"])
def test_the_true_wrench_comes_back(crisp, seen, a, b, free_moments_go_along):
    columns = [list(columns_of(plate)) for plate in crisp.plates]
    for column in (0, 2) if free_moments_go_along else (0,):
        columns[a][column], columns[b][column] = columns[b][column], columns[a][column]
    scene = seen(read_again(crisp, columns))
    true = seen(crisp).measured_ground
    fixed = PlateSwap(f"plate_{a + 1}+plate_{b + 1}").signature(scene, ()).fixed
    assert np.abs(scene.measured_ground - true).max() > 50
    np.testing.assert_allclose(scene.measured_ground + fixed, true, atol=1e-6)


def test_without_columns_of_centres_the_wrench_moves_with_its_plate(crisp, seen):
    """Channels exchanged before the centres of pressure were computed: all but the plates' places."""
    a, b = crisp.plates[1], crisp.plates[2]
    c_a, c_b = a.corners_ground.mean(axis=0), b.corners_ground.mean(axis=0)

    def at_place_of(plate, by):
        moment = plate.moment_ground + np.cross(by, plate.force_ground)
        return replace(plate, moment_ground=moment, cop_ground=plate.cop_ground + by)

    at_a = replace(at_place_of(b, c_a - c_b), name=a.name, corners_ground=a.corners_ground)
    at_b = replace(at_place_of(a, c_b - c_a), name=b.name, corners_ground=b.corners_ground)
    plates = list(crisp.plates)
    plates[1:3] = at_a, at_b
    scene = seen(replace(crisp, plates=tuple(plates)))
    fixed = PlateSwap("plate_2+plate_3").signature(scene, ()).fixed
    np.testing.assert_allclose(scene.measured_ground + fixed, seen(crisp).measured_ground, atol=1e-9)


def test_plates_with_clocks_of_their_own_are_not_exchanged(crisp, seen):
    plates = list(crisp.plates)
    plates[1] = replace(plates[1], start_time=0.01)
    scene = seen(replace(crisp, plates=tuple(plates)))
    assert PlateSwap("plate_2+plate_3").signature(scene, ()) is None
    assert PlateSwap("plate_3+plate_4").signature(scene, ()) is not None


def test_every_pair_is_a_candidate(crisp, seen):
    scene = seen(crisp)
    targets = [c.target for c in PlateSwap.candidates([scene, scene])]
    count = len(scene.plates)
    assert len(targets) == count * (count - 1) // 2
    assert targets[0] == "plate_1+plate_2"
    assert PlateSwap.candidates([scene])[0].is_notable({})
    assert PlateSwap.candidates([replace(scene, plates=scene.plates[:1])]) == []


def in_each_others_place(capture, a, b, nudge=(0.0, 0.0, 0.0)):
    """What plate b measured stands at plate a's place, and the other way round; pressures go along."""
    plates = list(capture.plates)
    middles = [plates[k].corners_ground.mean(axis=0) for k in (a, b)]
    apart = middles[1] - middles[0] + nudge
    for own, other, by in ((a, b, -apart), (b, a, apart)):
        taken = capture.plates[other]
        point = taken.cop_ground + by
        free = taken.moment_ground - np.cross(np.nan_to_num(taken.cop_ground), taken.force_ground)
        plates[own] = replace(
            capture.plates[own],
            force_ground=taken.force_ground,
            moment_ground=free + np.cross(np.nan_to_num(point), taken.force_ground),
            cop_ground=point,
            point_ground=point,
        )
    return replace(capture, plates=tuple(plates))


@pytest.mark.parametrize(("a", "b"), [(1, 2), (0, 2)], ids=["overlapping", "apart"])
def test_the_true_wrench_comes_back_where_all_is_exchanged(crisp, seen, a, b):
    scene, true = seen(in_each_others_place(crisp, a, b)), seen(crisp).measured_ground
    signature = PlateExchange(f"plate_{a + 1}+plate_{b + 1}").signature(scene, ())
    assert np.abs(scene.measured_ground - true).max() > 50
    np.testing.assert_allclose(scene.measured_ground + signature.fixed, true, atol=1e-6)


def test_middles_that_lie_farther_apart_are_a_shift(crisp, seen):
    scene, true = seen(in_each_others_place(crisp, 1, 2, (0.03, 0.0, -0.02))), seen(crisp).measured_ground
    signature = PlateExchange("plate_2+plate_3").signature(scene, ())
    lack = (true - scene.measured_ground - signature.fixed).reshape(-1)
    x = np.linalg.lstsq(signature.columns.reshape(-1, 2), lack, rcond=None)[0]
    np.testing.assert_allclose(np.abs(x), [0.03, 0.02], rtol=1e-6)
    np.testing.assert_allclose(signature.columns.reshape(-1, 2) @ x, lack, atol=1e-6)


def test_other_causes_are_told_of_the_other_plate():
    assert PlateExchange("plate_1+plate_2").target_corrected("plate_1") == "plate_2"
    assert PlateExchange("plate_1+plate_2").target_corrected("plate_3") == "plate_3"


def test_every_pair_is_a_candidate_where_the_files_hold_pressures(crisp, seen):
    """Without pressures `plate_swap` moves whole wrenches already."""
    assert PlateExchange.candidates([seen(crisp)]) == []
    exchanged = PlateExchange.candidates([seen(in_each_others_place(crisp, 1, 2))])
    assert "plate_2+plate_3" in [c.target for c in exchanged]
    assert all({"plate_2", "plate_3"} & set(c.targets) for c in exchanged)


def test_a_plate_that_nobody_used_has_no_place_without_its_corners(crisp, seen):
    exchanged = seen(in_each_others_place(crisp, 1, 2))
    idle = replace(exchanged.plates[2], loaded=np.zeros(exchanged.frames, dtype=bool))
    nowhere = replace(idle, plate=replace(idle.plate, corners_ground=None))
    for plate, there in ((idle, True), (nowhere, False)):
        plates = (*exchanged.plates[:2], plate, *exchanged.plates[3:])
        targets = [c.target for c in PlateExchange.candidates([replace(exchanged, plates=plates)])]
        assert ("plate_2+plate_3" in targets) == there


def misread(capture, columns, signs, refiled):
    """All plates with their force columns in another order, or with other signs."""

    def wrong(force, point, free):
        return force[:, columns] * signs, point, free

    return replace(capture, plates=tuple(refiled(plate, wrong) for plate in capture.plates))


@pytest.mark.parametrize(
    ("target", "columns_signs"),
    [("x", ((0, 1, 2), (-1, 1, 1))), ("z", ((0, 1, 2), (1, 1, -1))), ("xz", ((2, 1, 0), (1, 1, 1)))],
)
def test_the_true_wrench_comes_back_in_right_axes(crisp, seen, refiled, target, columns_signs):
    scene = seen(misread(crisp, *columns_signs, refiled))
    fixed = AxisConvention(target).signature(scene, ()).fixed
    true = seen(crisp).measured_ground
    assert np.abs(scene.measured_ground - true).max() > 50
    np.testing.assert_allclose(scene.measured_ground + fixed, true, atol=1e-8)


def test_a_wrong_vertical_sign_leaves_wrong_horizontal_ones_once_the_plate_is_upright(crisp, seen, refiled):
    without_free = replace(
        crisp, plates=tuple(refiled(p, lambda f, point, free: (f, point, 0 * free)) for p in crisp.plates)
    )
    down = misread(without_free, (0, 1, 2), (1, -1, 1), refiled)
    turned = replace(
        down,
        plates=tuple(
            replace(plate, force_ground=-plate.force_ground, moment_ground=-plate.moment_ground)
            for plate in down.plates
        ),
    )
    scene = seen(turned)
    fixed = AxisConvention("y").signature(scene, ()).fixed
    np.testing.assert_allclose(scene.measured_ground + fixed, seen(without_free).measured_ground, atol=1e-8)


def test_every_convention_is_a_candidate_where_anything_is_loaded(crisp, seen):
    scene = seen(crisp)
    made = AxisConvention.candidates([scene])
    assert {c.target for c in made} >= {"x", "z", "xz"}
    assert all(
        c.is_notable(c.estimates([scene], Fitted((), (), np.zeros(0), np.zeros((0, 0))))) for c in made
    )
    assert made[0].signature(replace(scene, plates=()), ()) is None
    assert AxisConvention.candidates([replace(scene, plates=())]) == []
