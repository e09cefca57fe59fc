from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.app.solve.comparison import around, changed_frames, compared, got_worse
from addb_viewer.app.solve.solve_controller import comparison_html
from tests.addb_viewer.fit_figures import first_layout, force, of_trial

FIGURES = of_trial(
    frames_with_force_used=180,
    marker_rms_m=0.0075,
    linear_residual=force(12.34),
    held_out=first_layout(33.0, 5.0, 40.0, 6.0),
)


@pytest.fixture
def pair(make_replay):
    """Two solves: later, frames 100 to 109 right are left out, and the knee gets 5 N·m more there."""
    before = make_replay()
    missing = (*before.forces.missing, (100, 110, "calcn_r", "manualReview"))
    torque = before.joints.torque.copy()
    torque[95:115, 1] += 5.0
    torque[5, 1] += 500.0  # far from the edit
    now = replace(
        before, forces=replace(before.forces, missing=missing), joints=replace(before.joints, torque=torque)
    )
    return before, now


def test_the_edit_is_where_forces_count_differently(pair):
    assert changed_frames(*pair).nonzero()[0].tolist() == list(range(100, 110))
    assert not changed_frames(pair[0], pair[0]).any()


def test_both_feet_flagged_one_by_one_is_the_same_as_together(pair):
    before, _ = pair
    together = replace(before, forces=replace(before.forces, missing=((5, 9, None, "a"),)))
    apart = replace(
        before, forces=replace(before.forces, missing=((5, 9, "calcn_r", "b"), (5, 9, "calcn_l", "c")))
    )
    assert not changed_frames(together, apart).any()


@pytest.mark.parametrize(
    ("added_N", "in_both", "words"),
    [
        (30.0, 1.0, ()),  # harder frames than those before, within the limit of 35 N
        (300.0, 1.0, ("residual force 20.0 → 300.0 N on frames that count now",)),
        (30.0, 1.2, ("residual force 20.0 → 24.0 N",)),
        (0.0, 1.05, ()),
    ],
)
def test_a_solve_is_worse_by_frames_that_count_in_both_or_by_what_is_beyond_the_limit_on_new_ones(
    make_replay, added_N, in_both, words
):
    replay = make_replay()
    force = np.zeros((replay.frames, 3))
    force[:, 1] = 20.0
    used = np.arange(replay.frames) >= 60
    before = replace(replay, residual=replace(replay.residual, force=force, moment=0 * force, used=used))
    now = in_both * force
    now[:60, 1] = added_N
    more = replace(replay, residual=replace(before.residual, force=now, used=used | True))
    assert got_worse(before, more, None, None) == words


def test_a_solve_with_larger_marker_errors_is_worse(pair):
    larger = replace(FIGURES, marker_rms_m=0.0085)
    assert got_worse(pair[0], pair[0], FIGURES, larger) == ("marker error 0.75 → 0.85 cm",)
    assert not got_worse(pair[0], pair[0], FIGURES, FIGURES)


def test_torques_are_compared_near_the_edit(pair):
    found = compared(*pair, FIGURES, FIGURES)
    assert found.edited == ((100, 110),)
    knee = found.torques[0]
    assert (knee.name, knee.unit) == ("knee_angle_r", "N·m")
    assert knee.largest == pytest.approx(5.0)
    near = 20 / 40  # frames with the change over those within 0.15 s
    assert knee.rms == pytest.approx(5.0 * np.sqrt(near), rel=1e-9)


def test_what_moves_the_root_is_the_residual_and_no_joint_torque(pair):
    before, now = (replace(r, joints=replace(r.joints, of_root=frozenset({"knee_angle_r"}))) for r in pair)
    assert "knee_angle_r" not in [change.name for change in compared(before, now, FIGURES, FIGURES).torques]


def test_figures_stand_side_by_side_with_units(pair):
    found = compared(*pair, FIGURES, replace(FIGURES, linear_residual=force(9.0)))
    assert ("Residual force", "12.3 N", "9.0 N") in found.rows
    assert ("Marker error", "0.75 cm", "0.75 cm") in found.rows
    assert ("Held-out force", "33.0 N", "33.0 N") in found.rows
    assert not any(label == "Residual moment" for label, _, _ in found.rows)
    text = comparison_html(found, "before")
    assert "100–109" in text
    assert "right knee torque: " in text


def test_reaching_around_frames():
    frames = np.zeros(10, dtype=bool)
    frames[[0, 6]] = True
    assert around(frames, 2).nonzero()[0].tolist() == [0, 1, 2, 4, 5, 6, 7, 8]
