"""A fit made anew near an edit: the rest stays, and what is made anew is where the whole cost is least."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.progress import silent
from solver.common.true_runs import runs
from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.trajectory.near_edits import InertiasBefore, fit_near_edits, spans_near
from solver.dynamics.trajectory.spline_basis import DEGREE
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import State, TrajectorySolver
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.forward import marker_positions

RATE, FRAMES, SPACING = 50.0, 90, 2
SETTINGS = TrajectorySettings(
    knot_spacing_s=SPACING / RATE, tolerance=1e-10, iterations=40, fit_inertias=False, edit_reach_s=0.3
)
EDITED = slice(40, 46)


@pytest.fixture(scope="module")
def trials(crane, crane_q):
    """One after the other, with forces that no motion explains."""
    rng, made = np.random.default_rng(4), []
    for _ in range(2):
        motion = Motion(crane.dofs, crane_q[:FRAMES], RATE)
        exact = marker_positions(crane, motion.q)
        recorded = required_ground(crane, motion) + rng.normal(0, 30, (FRAMES, 6))
        made.append(
            TrialData(
                exact + rng.normal(0, 0.003, exact.shape), recorded, np.ones(FRAMES, dtype=bool), motion
            )
        )
    return made


@pytest.fixture(scope="module")
def edited(crane, trials):
    """The first fit, the trials without some of the second one's forces, and their fit near these."""
    first = fit_trajectories(crane, trials, SETTINGS)
    counts = np.ones(FRAMES, dtype=bool)
    counts[EDITED] = False
    flagged = [trials[0], replace(trials[1], counts=counts)]
    begun = [replace(t, spline=s) for t, s in zip(flagged, first.splines, strict=True)]
    frames = [t.counts != before.counts for t, before in zip(flagged, trials, strict=True)]
    before = InertiasBefore(first.phi, first.asked_phi)
    return first, begun, fit_near_edits(crane, begun, frames, SETTINGS, silent, before=before)


def test_nothing_else_moves(edited):
    first, _, near = edited
    np.testing.assert_array_equal(near.splines[0], first.splines[0])
    moved = np.abs(near.splines[1] - first.splines[1]).max(axis=1) > 1e-12
    ((start, end),) = runs(moved)
    reach = round(SETTINGS.edit_reach_s * RATE)
    assert start >= (EDITED.start - reach) // SPACING + DEGREE - 1
    assert end <= (EDITED.stop + reach) // SPACING + 1 + 1
    assert near.converged


def test_the_whole_cost_is_least_by_what_was_made_anew(crane, edited):
    """Its gradient is the judge: it knows of no parts and of no held ends."""
    first, begun, near = edited
    whole = TrajectorySolver(crane, begun, SETTINGS)
    shared = whole.shared(np.zeros(len(first.phi)), np.zeros(0))
    before, after = (
        np.abs(whole.gradient(State(list(fit.splines), shared)).coefficients[1]) for fit in (first, near)
    )
    moved = np.abs(near.splines[1] - first.splines[1]).max(axis=1) > 1e-12
    assert after[moved].max() < 1e-3 * before[moved].max()


def test_the_farther_it_reaches_the_nearer_it_is_to_a_fit_of_all_frames(crane, trials, edited):
    """An edit's effect dies away; a second beyond it nothing is left that anybody would see."""
    first, begun, _ = edited
    plain = [replace(trial, counts=own.counts) for trial, own in zip(trials, begun, strict=True)]
    whole = fit_trajectories(crane, plain, SETTINGS)
    frames = [own.counts != trial.counts for own, trial in zip(begun, trials, strict=True)]
    before, missed = InertiasBefore(first.phi, first.asked_phi), []
    for reach_s in (0.1, 0.3, 0.7):
        weights = replace(SETTINGS, edit_reach_s=reach_s)
        near = fit_near_edits(crane, begun, frames, weights, silent, before=before)
        missed.append(np.abs(near.motions[1].q - whole.motions[1].q).max())
    effect = np.abs(whole.motions[1].q - first.motions[1].q).max()
    assert missed[0] > 2 * missed[1] > 4 * missed[2]
    assert missed[2] < 0.05 * effect


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stretch", "push_N"), [(EDITED, 300.0), (EDITED, 8000.0), (slice(10, 80), 2000.0)], ids=str
)
def test_the_edits_own_gain_decides_where_the_search_ends(crane, trials, stretch, push_N):
    """Counted frames whose force is far off end where a cold fit does, whatever the subject costs elsewhere.

    Markers that are centimetres off make that much. The cold fit begins at them and leaves nothing.
    """
    off = 0.06 * np.random.default_rng(3).normal(size=trials[0].observed_ground.shape[1:])
    gross = trials[1].wrench_ground.copy()
    gross[stretch] += push_N * np.array([0.3, 1.0, -0.2, 0.1, 0.0, 0.2])
    one, other = (replace(trial, observed_ground=trial.observed_ground + off) for trial in trials)
    counted = [one, replace(other, wrench_ground=gross)]
    hidden = np.ones(FRAMES, dtype=bool)
    hidden[stretch] = False
    first = fit_trajectories(crane, [one, replace(counted[1], counts=hidden)], SETTINGS)
    begun = [replace(t, spline=s) for t, s in zip(counted, first.splines, strict=True)]
    usual = replace(SETTINGS, tolerance=TrajectorySettings().tolerance, iterations=12, edit_reach_s=1.0)
    frames = [np.zeros(FRAMES, dtype=bool), ~hidden]
    before = InertiasBefore(first.phi, first.asked_phi)
    near = fit_near_edits(crane, begun, frames, usual, silent, before=before)
    anew = fit_trajectories(crane, begun, usual, phi=first.phi, edited=True)
    cold = fit_trajectories(crane, counted, replace(SETTINGS, tolerance=1e-9, iterations=1000))
    asked = required_ground(crane, cold.motions[1])
    for after in (near, anew):
        assert after.converged
        missed = np.abs(required_ground(crane, after.motions[1]) - asked)
        assert missed[:, :3].max() < 1.0
        assert missed[:, 3:].max() < 0.1


def test_nothing_edited_gives_the_former_fit(crane, trials, edited):
    first, begun, _ = edited
    none = [np.zeros(FRAMES, dtype=bool)] * 2
    same = fit_near_edits(crane, begun, none, SETTINGS, silent, before=InertiasBefore(first.phi, first.phi))
    for a, b in zip(same.motions, first.motions, strict=True):
        np.testing.assert_allclose(a.q, b.q, atol=1e-12)


def test_spans_go_from_knot_to_knot_and_end_with_the_trial(crane, crane_q):
    motion = Motion(crane.dofs, crane_q[:FRAMES], RATE)
    frames = np.zeros(FRAMES, dtype=bool)
    frames[[5, 41, 47, FRAMES - 3]] = True
    first, middle, last = spans_near([frames], [motion], replace(SETTINGS, edit_reach_s=0.1))
    assert (first.start, last.end) == (0, FRAMES)
    for span in (first, middle, last):
        assert span.start % SPACING == 0
    for span in (first, middle):
        assert (span.end - 1) % SPACING == 0
    assert middle.start <= 41 - 5 < 47 + 5 < middle.end
