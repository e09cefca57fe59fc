"""Forces of two plates in each other's columns, read from a file that looks so."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.capture.formats.storage import Storage
from solver.capture.plates.moment_convention import plates_from_storage
from solver.diagnosis.causes.exchanged_forces import PlateSwap


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
