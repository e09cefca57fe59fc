"""Chosen quantities over the gait cycle, against knees that swing once a stride."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.trial_view.by_cycle import CycledTrial, axis_limits, cycle_charts
from addb_viewer.trial_view.trial_curves import TrialCurves
from solver.gait.cycles import Cycle
from solver.gait.trial_gait import Gait
from tests.made_std import made_std

SECONDS = 2 * np.pi / 6  # of a swing of `make_replay`'s knees, which begin at 2.0 s
ANGLE, TORQUE = "knee_angle angle", "knee_angle torque"


def strides(foot, *starts):
    return tuple(Cycle(foot, s, s + 0.6 * SECONDS, s + SECONDS, 1.0, 0.5, 0.1) for s in starts)


@pytest.fixture
def walk(make_replay):
    """Four seconds: the right foot takes three strides, the left one two, half a swing later."""
    replay = make_replay(frames=400)
    right, left = (
        strides(0, 2.0, 2.0 + SECONDS, 2.0 + 2 * SECONDS),
        strides(1, 2.0 + SECONDS / 2, 2.0 + 1.5 * SECONDS),
    )
    gait = Gait(("calcn_r", "calcn_l"), (), (*right, *left))
    curves = TrialCurves("walk", replay.rate, replay.times, replay.joints, replay.residual.used)
    return CycledTrial(curves, gait)


def test_each_side_is_drawn_over_the_strides_of_its_own_foot(walk):
    (chart,) = cycle_charts(walk, (), (ANGLE,))["charts"]
    assert [(line["label"], line["count"], line["foot_off"]) for line in chart["lines"]] == [
        ("right", 3, 60.0), ("left", 2, 60.0)
    ]  # fmt: skip
    expected = np.degrees(0.5 * np.sin(2 * np.pi * np.arange(101) / 100))
    for line in chart["lines"]:  # both knees begin their swing as their own foot lands
        np.testing.assert_allclose(line["mean"], expected, atol=0.05)
        np.testing.assert_allclose(line["std"], 0.0, atol=0.05)
        np.testing.assert_allclose(line["strides"], np.tile(expected, (line["count"], 1)), atol=0.05)
    assert chart["low"] < expected.min() < expected.max() < chart["high"]


def test_torques_are_of_strides_whose_frames_all_count_and_that_is_told(walk):
    drawn = cycle_charts(walk, (), (TORQUE, ANGLE))  # the first 20 frames do not count
    torque, angle = drawn["charts"]
    assert [line["count"] for line in torque["lines"]] == [2, 2]
    assert [line["count"] for line in angle["lines"]] == [3, 2]
    assert drawn["note"] == "1 stride is left out of torques and powers: not all frames count."
    assert [len(drawn["strides"][side]) for side in ("right", "left")] == [3, 2]
    nothing = replace(walk, of=replace(walk.of, counts=np.zeros(400, dtype=bool)))
    drawn = cycle_charts(nothing, (), (TORQUE, ANGLE, "marker error"))
    assert [chart["title"] for chart in drawn["charts"]] == ["Knee flexion angle"]
    assert drawn["note"] == (
        "No stride whose frames all count, so no curve: Knee flexion torque. "
        "Marker errors and plate forces are shown over time only."
    )
    predicted = replace(nothing.of, joints=replace(walk.of.joints, predicted=True))
    (chart,) = cycle_charts(replace(walk, of=predicted), (), (TORQUE,))["charts"]
    assert (chart["title"], chart["left_out"]) == ("Predicted knee flexion torque", 0)


def test_how_far_a_stride_may_be_off_by_itself_is_told_at_its_side(walk):
    banded = replace(walk, of=replace(walk.of, joints=replace(walk.of.joints, std=made_std(400, 3))))
    (chart,) = cycle_charts(banded, (), (ANGLE,))["charts"]
    within = [line["why"] for line in chart["lines"]]
    between = "±, band: standard deviation between strides"
    assert within == [f"{n} strides; {between}; standard deviation within a stride: 0.573 °" for n in (3, 2)]
    (chart,) = cycle_charts(walk, (), (ANGLE,))["charts"]
    assert chart["lines"][0]["why"] == f"3 strides; {between}"


def test_the_trunk_is_drawn_over_the_strides_of_either_foot(walk):
    (chart,) = cycle_charts(walk, (), ("pelvis_tx speed",))["charts"]
    assert [(line["label"], line["count"]) for line in chart["lines"]] == [("right", 3), ("left", 2)]


def test_other_trials_lie_over_it_as_their_means(walk):
    run = CycledTrial(replace(walk.of, name="run"), replace(walk.gait, cycles=walk.gait.cycles[:1]))
    standing = CycledTrial(replace(walk.of, name="standing"), None)
    (chart,) = cycle_charts(walk, [run, standing], (ANGLE,))["charts"]
    (one,) = [line for line in chart["lines"] if line["trial"]]  # one stride has no deviation
    assert [one[key] for key in ("trial", "label", "count", "std")] == ["run", "right", 1, None]
    np.testing.assert_allclose(one["mean"], chart["lines"][0]["strides"][0])


def test_the_solve_that_is_compared_with_lies_behind_as_its_means(walk):
    bent = replace(walk.of.joints, position=walk.of.joints.position + 0.1)
    before = replace(walk, of=replace(walk.of, joints=bent))
    (chart,) = cycle_charts(walk, (), (ANGLE,), before)["charts"]
    own, was = ([line for line in chart["lines"] if line["style"] == style] for style in ("", "before"))
    assert [line["label"] for line in was] == ["right", "left"]
    np.testing.assert_allclose(np.subtract(was[0]["mean"], own[0]["mean"]), np.degrees(0.1), atol=0.02)


def test_without_strides_that_is_said(walk):
    drawn = cycle_charts(replace(walk, gait=None), (), (ANGLE,))
    assert (drawn["charts"], drawn["note"][:37]) == ([], "No gait cycles: nobody walks or runs ")


def test_an_axis_holds_zero_and_has_a_length():
    assert axis_limits([]) == axis_limits([0.0, 0.0]) == (0.0, 1.0)
    low, high = axis_limits([-3.0, -1.0])
    assert (low < -3.0, high) == (True, pytest.approx(0.0, abs=0.2))
    low, high = axis_limits([2.0, 5.0])
    assert (low, high > 5.0) == (0.0, True)
