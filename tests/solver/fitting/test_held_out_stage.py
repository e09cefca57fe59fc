"""A real walk judged on all layouts of held-out forces, and a fit that never saw those of one."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.progress import silent
from solver.common.typed_json import plain
from solver.dynamics.cross_validation.held_out_layouts import LAYOUTS, hold_out_blocks
from solver.dynamics.force_prediction.held_out_prediction import HeldOutPrediction
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.fitting.held_out_stage import leave_stances_out, predict_held_out
from solver.fitting.pipeline import resolve
from solver.fitting.settings import Settings
from solver.fitting.state import MassAndGains
from solver.fitting.summary import summary
from solver.fitting.torques_stage import under_forces
from solver.fitting.trajectory_stage import all_data, before_forces, begin_at_forces
from solver.skeleton.scaling import with_mass
from tests.flagged import flagged

MOTION_ALONE = replace(Settings(), prediction=replace(Settings().prediction, enabled=False))
OFF = 1.0  # [N, N·m] that the step may be off, of 35 to 53 N and 38 N·m missed


@pytest.fixture(scope="module")
def walk(recorded_fit):
    return recorded_fit("walk_gait2354_subject01")


def judged_again(fit, settings):
    return predict_held_out(replace(fit, held_out_due=True), settings, silent)


def test_every_known_frame_but_the_ends_is_held_out_and_the_markers_stand_beside(walk):
    assert not walk.held_out_due
    assert tuple((layout.kind, layout.number) for layout in walk.held_out_layouts) == LAYOUTS
    (trial,) = walk.trials
    block = round(Settings().trajectory.held_out_block_s * trial.motion.rate)
    known = np.flatnonzero(trial.forces_known)
    blocks = [layout.trials["walk1"] for layout in walk.held_out_layouts if layout.kind == "blocks"]
    seen = np.zeros(trial.motion.frames, dtype=bool)
    for layout in blocks:
        for start, end in layout.ranges:
            seen[start:end] = True
    assert len(blocks) == 6
    assert seen[known[block:-block]].all()
    figures = plain(summary(walk))["trials"][0]["held_out_layouts"]
    for kind in ("blocks", "steps"):
        force, moment = figures[kind]["force"], figures[kind]["moment"]
        assert all(3 <= hz <= 30 for of in (force, moment) for hz in of["markers_cutoffs_hz"])
        assert 0 < force["rms"] < 100 < 10 * force["markers_rms"] < 1000
    first = walk.held_out_layouts[0].trials["walk1"]
    np.testing.assert_allclose(
        first.missed.sum(axis=0)[0], np.sum(trial.held_out.residual_root[trial.held_out.frames, :3] ** 2)
    )


def never_shown(walk, number):
    """Residual [N, N·m] on the frames that a layout of blocks holds out, of a fit that never saw them."""
    before = before_forces(walk.trials[0])
    frames = hold_out_blocks(before.forces_known, before.motion.rate, MOTION_ALONE.trajectory, number)
    ours = under_forces_without(walk, frames)
    return ours.residual_root[frames & ours.used]


def under_forces_without(walk, frames):
    """Dynamics of a fit that begins at the markers and knows of some frames' forces but their weight."""
    ground, before = walk.groundwork, before_forces(walk.trials[0])
    weights, settled = MOTION_ALONE.trajectory, ground.settled
    known = replace(before, mask=replace(before.mask, counts=before.mask.counts & ~frames[:, None]))
    skeleton = with_mass(ground.skeleton, settled.mass_kg)
    weighed = MassAndGains(settled.mass_kg, (settled.gains["walk1"],))
    (data,) = all_data([known], ground.match, weighed, None)
    begun = begin_at_forces(data, known, skeleton, MOTION_ALONE)
    result = fit_trajectories(skeleton, [begun], weights, mass_is_fitted=True)
    return under_forces(before, result.motions[0], result.skeleton, MOTION_ALONE)


def test_a_stance_left_out_moves_torques_elsewhere_as_in_a_fit_without_it(walk):
    """Of two stances each is left out: how the two differ does not depend on where searches began."""
    first, second = leave_stances_out(walk, Settings())
    assert (first.foot, second.foot) == ("calcn_r", "calcn_l")
    (trial,) = walk.trials
    hidden = np.zeros((2, trial.motion.frames), dtype=bool)
    for frames, one in zip(hidden, (first, second), strict=True):
        frames[slice(*one.frames)] = True
        assert trial.forces_known[frames].all()
        assert np.isnan(one.torque_change[frames]).all()
        assert one.change == one.torque_change[one.at_frame, walk.skeleton.dofs.index(one.dof)]
    elsewhere = trial.dynamics.used & ~hidden.any(axis=0)
    told = (second.torque_change - first.torque_change)[elsewhere, 6:]
    without = [under_forces_without(walk, frames).joint_torques[elsewhere, 6:] for frames in hidden]
    refit = without[1] - without[0]
    assert np.sqrt(np.mean((told - refit) ** 2)) < 0.25 * np.sqrt(np.mean(refit**2))


def test_a_first_flag_begins_with_what_the_judged_fit_learnt(recorded_fit):
    """No force was missing before; torques are nearly those of a fit of all frames to what is left."""
    fit = recorded_fit("walk_treadmill_stepwidth")
    flags = {"example1": flagged((200, 230, None, "manualReview"))}
    unlearnt = replace(fit, groundwork=replace(fit.groundwork, learnt=None))
    fits = fit, resolve(fit, flags, Settings()), resolve(unlearnt, flags, Settings())
    first, ours, anew = (one.trials[0].dynamics.joint_torques for one in fits)
    assert np.sqrt(np.mean((ours - anew) ** 2)) < 0.1 * np.sqrt(np.mean((anew - first) ** 2))


@pytest.mark.parametrize("number", [0, 3])
def test_the_step_predicts_what_a_fit_that_never_saw_the_forces_predicts(walk, number):
    layout = judged_again(walk, MOTION_ALONE).held_out_layouts[number].trials["walk1"]
    step = np.sqrt(layout.missed.sum(axis=0) / layout.frames.sum())
    missed = never_shown(walk, number)
    assert len(missed) == layout.frames.sum()
    refit = [np.sqrt((missed[:, axes] ** 2).sum(axis=1).mean()) for axes in np.s_[:3, 3:]]
    np.testing.assert_allclose(step, refit, rtol=0, atol=OFF)


@pytest.mark.parametrize("layout", [("blocks", 2), ("steps", 1)])
def test_neither_the_step_nor_the_markers_cutoff_sees_the_forces_that_judge_it(walk, layout):
    """Forces of the held-out frames moved by ± d: where nobody saw them, the squares add up to the penny."""
    k, d, sums = LAYOUTS.index(layout), 150.0, []
    plain = judged_again(walk, MOTION_ALONE).held_out_layouts[k].trials["walk1"]
    for sign in (1, -1):
        trial = walk.trials[0]
        wrench = trial.contacts.wrench_ground.copy()
        for start, end in plain.ranges:
            wrench[start:end, 0, 1] += sign * d
        contacts = replace(trial.contacts, wrench_ground=wrench)
        edited = replace(walk, trials=(replace(trial, contacts=contacts),))
        told = judged_again(edited, MOTION_ALONE).held_out_layouts[k].trials["walk1"]
        assert told.markers_hz == plain.markers_hz
        sums.append((told.missed[:, 0], told.markers_missed[:, 0]))
    for ours, before in zip(np.add(*sums), (plain.missed[:, 0], plain.markers_missed[:, 0]), strict=True):
        np.testing.assert_allclose(ours, 2 * before + 2 * plain.frames * d**2, rtol=1e-6)


def test_a_trial_too_short_to_hold_anything_out_is_judged_on_nothing(walk):
    """Twenty known frames are left, as few as a fit takes: no layout has a block there."""
    (trial,) = walk.trials
    counts = trial.mask.counts.copy()
    known = np.flatnonzero(trial.forces_known)
    counts[known[20:]] = False
    short = replace(walk, trials=(replace(trial, mask=replace(trial.mask, counts=counts), held_out=None),))
    judged = judged_again(short, Settings())
    assert not judged.held_out_due
    assert judged.trials[0].held_out is None
    assert all(not layout.trials for layout in judged.held_out_layouts)
    assert plain(summary(judged))["trials"][0]["held_out_layouts"] == {"blocks": None, "steps": None}


def test_kinds_that_have_no_columns_any_more_are_chosen_anew(walk):
    before = [replace(layout, learnt=("gone",)) for layout in walk.held_out_layouts]
    again = predict_held_out(replace(walk, held_out_due=True), Settings(), silent, before=before)
    assert [layout.learnt for layout in again.held_out_layouts] == [
        layout.learnt for layout in walk.held_out_layouts
    ]


def test_the_kinds_of_a_former_fit_stay_without_being_asked_again(walk, monkeypatch):
    monkeypatch.setattr(HeldOutPrediction, "best_kinds", lambda *_, **__: pytest.fail("asked again"))
    again = predict_held_out(
        replace(walk, held_out_due=True), Settings(), silent, before=walk.held_out_layouts
    )
    for one, other in zip(again.held_out_layouts, walk.held_out_layouts, strict=True):
        assert one.learnt == other.learnt
        for name, blocks in one.trials.items():
            np.testing.assert_allclose(blocks.missed, other.trials[name].missed)


def test_nothing_is_told_of_a_stance_where_no_torque_is_used_elsewhere(walk):
    (trial,) = walk.trials
    first, _ = leave_stances_out(walk, Settings())
    used = np.zeros_like(trial.dynamics.used)
    used[slice(*first.frames)] = True
    alone = replace(trial, dynamics=replace(trial.dynamics, used=used))
    assert [one.foot for one in leave_stances_out(replace(walk, trials=(alone,)), Settings())] == ["calcn_l"]
