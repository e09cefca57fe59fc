"""Two plates in each other's place, made by moving forces and pressures one by one."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.exchanged_forces import PlateExchange


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
def test_the_true_wrench_comes_back(crisp, seen, a, b):
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
