"""A re-solve after an edit of the flags against a solve from the beginning, which knows of no previous fit.

The bound is what the trajectory fit's own tolerance leaves open: two searches of the same problem from
different sides end 0.3 N and 0.001 rad apart, a tenth of the residuals and of what markers tell.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import Cancelled, FitError
from solver.common.progress import silent
from solver.dynamics.force_prediction.held_out_prediction import HeldOutPrediction
from solver.fitting import review_stage, trajectory_stage
from solver.fitting.edit_stage import small_edit
from solver.fitting.fit_result import Fit
from solver.fitting.held_out_stage import predict_held_out
from solver.fitting.pipeline import can_resolve, resolve, solve
from solver.fitting.results.store import load_fit, save_fit
from solver.fitting.settings import Settings, as_dict
from solver.fitting.state import MassAndGains
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.simulate.subject_folder import write_subject
from tests.conftest import MARKERS_ALONE, NO_HELD_OUT
from tests.flagged import flagged

pytestmark = pytest.mark.slow  # their fixtures take long

FORCE_N, MOMENT_NM, TORQUE_NM = 0.5, 0.5, 2.0
ANGLE_RAD = 0.002
SETTINGS = Settings()
ENDS = 10  # frames at each end, as the figures leave them out


@dataclass(frozen=True)
class Case:
    """A fit, and another set of flags."""

    first: Fit
    before: dict
    after: dict

    @cached_property
    def reviewed(self) -> Fit:
        return resolve(self.first, self.after, SETTINGS)

    @cached_property
    def cold(self) -> Fit:
        return solve(self.first.subject, SETTINGS, reviews=self.after)


def case_of(plain: Fit) -> Case:
    (trial,) = plain.trials
    name, before = trial.capture.name, tuple(r for r in trial.mask.reasons if r[3] != "hasNoForcePlateData")
    used = np.flatnonzero(trial.dynamics.used)
    start = int(used[len(used) // 2])
    after = (*before, (start, start + 25, trial.contacts.foot_bodies[0], "manualReview"))
    reviews = {name: flagged(*before)}
    return Case(solve(plain.subject, SETTINGS, reviews=reviews), reviews, {name: flagged(*after)})


@pytest.fixture(scope="module")
def case(walking_woman) -> Case:
    return case_of(solve(open_subject(walking_woman), MARKERS_ALONE))


@pytest.fixture(scope="module")
def real_case(recorded_fit) -> Case:
    return case_of(recorded_fit("walk_rajagopal2015", MARKERS_ALONE))


def assert_agree(first: Fit, second: Fit) -> None:
    assert first.mass_kg == pytest.approx(second.mass_kg, abs=0.05)
    assert first.notes == second.notes
    for one, other in zip(first.trials, second.trials, strict=True):
        assert one.mask.reasons == other.mask.reasons
        np.testing.assert_array_equal(one.dynamics.used, other.dynamics.used)
        assert one.proposals == other.proposals
        assert one.notes == other.notes
        inner = slice(ENDS, -ENDS)
        residual = (one.dynamics.residual_root - other.dynamics.residual_root)[inner]
        torque = (one.dynamics.joint_torques - other.dynamics.joint_torques)[inner]
        assert np.sqrt((residual[:, :3] ** 2).sum(axis=1).mean()) < FORCE_N
        assert np.sqrt((residual[:, 3:] ** 2).sum(axis=1).mean()) < MOMENT_NM
        assert np.abs(torque).max() < TORQUE_NM
        assert np.sqrt(((one.motion.q - other.motion.q) ** 2).mean()) < ANGLE_RAD
        assert one.marker_errors.rms == pytest.approx(other.marker_errors.rms, abs=1e-4)


@pytest.fixture(scope="module")
def reviewed(case) -> Fit:
    return case.reviewed


@pytest.mark.parametrize("which", ["case", pytest.param("real_case", marks=pytest.mark.real)])
def test_a_new_flag_gives_what_a_solve_from_the_beginning_gives(request, which):
    case = request.getfixturevalue(which)
    (trial,) = case.reviewed.trials
    assert trial.mask.reasons != case.first.trials[0].mask.reasons
    assert_agree(case.reviewed, case.cold)


def trial_flags(case: Case) -> tuple:
    return tuple(r for r in case.first.trials[0].mask.reasons if r[3] != "hasNoForcePlateData")


def moved(case: Case, frames: int) -> dict:
    """The last flag that `after` adds, later by so many frames."""
    (name,) = case.after
    (trial,) = case.first.trials
    used = np.flatnonzero(trial.dynamics.used)
    start = int(used[len(used) // 2]) + frames
    return {
        name: flagged(*trial_flags(case), (start, start + 25, trial.contacts.foot_bodies[0], "manualReview"))
    }


def test_another_flag_takes_one_fit_and_asks_no_blocks_anew(case, reviewed, monkeypatch):
    """What is learnt of a person outlasts a few flags; from the beginning it takes two fits and a choice."""
    cold, fits = solve(case.first.subject, NO_HELD_OUT, reviews=moved(case, 5)), []
    fit = trajectory_stage.fit_trajectories
    with monkeypatch.context() as watched:
        watched.setattr(
            HeldOutPrediction, "best_kinds", lambda *_, **__: pytest.fail("blocks were asked anew")
        )
        watched.setattr(trajectory_stage, "fit_trajectories", lambda *a, **k: fits.append(0) or fit(*a, **k))
        warm = resolve(reviewed, moved(case, 5), SETTINGS)
    assert len(fits) == 1
    assert warm.groundwork.learnt.kinds == cold.groundwork.learnt.kinds
    assert_agree(warm, cold)


@pytest.mark.real
def test_solving_to_the_last_digit_moves_nothing_further(recorded_fit):
    fit = recorded_fit("walk_gait2354_subject01")
    weights = replace(SETTINGS.trajectory, tolerance=1e-7, iterations=60, edits_last=-1.0)
    tight = replace(SETTINGS, trajectory=weights)
    end = resolve(replace(fit, settings=as_dict(tight)), {}, tight)
    ended, moved = (one.trials[0].dynamics.joint_torques for one in (fit, end))
    assert np.sqrt(np.mean((moved - ended)[fit.trials[0].dynamics.used] ** 2)) < 0.03


def test_many_changed_frames_ask_blocks_anew(case, reviewed, monkeypatch):
    asked = []
    choose = HeldOutPrediction.best_kinds
    monkeypatch.setattr(HeldOutPrediction, "best_kinds", lambda *a, **k: asked.append(0) or choose(*a, **k))
    (trial,) = reviewed.trials
    known = np.flatnonzero(trial.forces_known)
    most = (int(known[0]), int(known[2 * len(known) // 3]), None, "manualReview")
    (name,) = case.after
    fewer = resolve(reviewed, {name: flagged(*trial_flags(case), most)}, SETTINGS)
    assert asked
    assert fewer.groundwork.learnt_on != reviewed.groundwork.learnt_on


@pytest.mark.parametrize(("moved", "asked"), [(0.0005, 0), (0.002, 1)])
def test_proposals_stand_until_the_mass_has_moved(case, moved, asked, monkeypatch):
    calls, ground = [], case.first.groundwork
    monkeypatch.setattr(review_stage, "detect", lambda *_, **__: calls.append(0) or ())
    ground = replace(ground, mass_kg=(1 + moved) * ground.mass_kg)
    resolve(replace(case.first, groundwork=ground), case.before, SETTINGS)
    assert len(calls) == asked


def test_taking_it_back_gives_the_first_fit_again(case, reviewed):
    assert_agree(resolve(reviewed, case.before, SETTINGS), case.first)


def test_the_held_out_blocks_are_due_and_then_those_of_a_solve_from_the_beginning(case, reviewed):
    assert reviewed.held_out_due
    assert reviewed.trials[0].held_out is None
    ours, cold = predict_held_out(reviewed, SETTINGS, silent), case.cold
    assert not ours.held_out_due
    np.testing.assert_array_equal(ours.trials[0].held_out.frames, cold.trials[0].held_out.frames)
    np.testing.assert_allclose(
        ours.trials[0].held_out.residual_root, cold.trials[0].held_out.residual_root, atol=1e-3
    )


def test_a_fit_from_the_disk_is_as_good_a_start(case, reviewed, tmp_path):
    save_fit(case.first, tmp_path)
    kept = load_fit(tmp_path, case.first.subject.folder)
    again = resolve(kept, case.after, SETTINGS)
    np.testing.assert_allclose(again.trials[0].motion.q, reviewed.trials[0].motion.q, atol=1e-12)


def test_the_search_begins_where_the_last_one_ended(case):
    """Nothing changed: nothing moves by more than one last step of a search that has arrived."""
    same = resolve(case.first, case.before, SETTINGS)
    assert_agree(same, case.first)
    assert same.provenance == case.first.provenance


def test_what_can_be_resolved(case, tmp_path):
    first, subject = case.first, case.first.subject
    assert can_resolve(first, subject, subject.trials, SETTINGS)
    other = replace(SETTINGS, trajectory=replace(SETTINGS.trajectory, smoothness=100.0))
    assert not can_resolve(first, subject, subject.trials, other)
    assert not can_resolve(first, replace(subject, mass_kg=50.0), subject.trials, SETTINGS)
    assert not can_resolve(replace(first, groundwork=None), subject, subject.trials, SETTINGS)
    with pytest.raises(FitError, match="--force"):
        resolve(first, case.after, other)


def test_a_review_of_another_recording_is_refused(case):
    (name,) = case.after
    with pytest.raises(FitError, match=rf"{name}: Frames 9000 to 9099 are flagged"):
        resolve(case.first, {name: flagged((9000, 9100, None, "manualReview"))}, SETTINGS)


@pytest.fixture(scope="module")
def two_walks(tmp_path_factory):
    """A fit of two short walks, and its settings: edits reach a tenth of one, and may change a third."""
    who, duration = Person(sex="female"), 2.3
    body_rng, noise_rng, *motion_rngs = np.random.default_rng(7).spawn(4)
    body, recordings = body_of(who, body_rng), []
    for name, rng in zip(("first", "second"), motion_rngs, strict=True):
        trial = simulate_trial(Scenario(name, "walk", duration=duration), body, rng)
        plates = plates_under(trial.contacts, (0.0, duration))
        recordings.append(measure(trial, plates, MARKERS, MeasurementSettings(), noise_rng))
    folder = tmp_path_factory.mktemp("two_walks")
    write_subject(folder, who, recordings)
    weights = replace(SETTINGS.trajectory, edit_reach_s=0.2, edits_last=0.3, edit_gain=0.01)
    settings = replace(SETTINGS, trajectory=weights)
    return solve(open_subject(folder), settings), settings


def test_a_small_edit_is_followed_near_it_alone(two_walks, monkeypatch):
    """The first one needs a prediction fit, whose kinds of terms the held-out blocks have chosen before."""
    first, settings = two_walks
    name, foot = first.trials[0].capture.name, first.trials[0].contacts.foot_bodies[0]
    one, other = (60, 75, foot, "manualReview"), (140, 155, foot, "manualReview")
    with monkeypatch.context() as watched:
        for module, whole in ((trajectory_stage, "fit_trajectories"), (HeldOutPrediction, "best_kinds")):
            watched.setattr(module, whole, lambda *_, **__: pytest.fail("all frames were asked"))
        once = resolve(first, {name: flagged(one)}, settings)
        twice = resolve(once, {name: flagged(one, other)}, settings)
    assert twice.trials[0].dynamics.used.sum() < once.trials[0].dynamics.used.sum()
    far = np.r_[0:30, 185:231]
    np.testing.assert_array_equal(twice.trials[0].motion.q[far], first.trials[0].motion.q[far])
    cold = solve(first.subject, NO_HELD_OUT, reviews={name: flagged(one, other)})
    near, whole = (fit.trials[0] for fit in (twice, cold))
    both = np.flatnonzero(near.dynamics.used & whole.dynamics.used)[ENDS:-ENDS]
    residual, torque = (
        getattr(near.dynamics, what)[both] - getattr(whole.dynamics, what)[both]
        for what in ("residual_root", "joint_torques")
    )
    assert np.sqrt((residual[:, :3] ** 2).sum(axis=1).mean()) < FORCE_N
    assert np.sqrt((residual[:, 3:] ** 2).sum(axis=1).mean()) < MOMENT_NM
    assert np.abs(torque).max() < TORQUE_NM
    assert np.sqrt(((near.motion.q - whole.motion.q) ** 2).mean()) < ANGLE_RAD


def test_edits_that_add_up_make_all_frames_anew(two_walks):
    first, settings = two_walks
    name, feet = first.trials[0].capture.name, first.trials[0].contacts.foot_bodies
    less = replace(settings, trajectory=replace(settings.trajectory, edits_last=0.05))
    start = replace(first, settings=as_dict(less))
    one = resolve(start, {name: flagged((60, 75, feet[0], "manualReview"))}, less)
    both = {name: flagged((60, 75, feet[0], "manualReview"), (140, 155, feet[0], "manualReview"))}
    two = resolve(one, both, less)
    assert one.groundwork.settled.known_to_all == first.groundwork.settled.known_to_all
    assert two.groundwork.settled.known_to_all == two.groundwork.settled.known


def test_a_small_edit_leaves_other_trials_and_what_was_judged_of_other_forces(two_walks):
    plain, settings = two_walks
    foot, first_frame = plain.trials[1].contacts.foot_bodies[0], plain.trials[1].capture.markers.first_frame
    start, other = plain.held_out_layouts[0].trials["second"].ranges[[0, -1], 0].tolist()
    once, flag = ((k - first_frame, k - first_frame + 9, foot, "manualReview") for k in (other, start))
    first = resolve(plain, {"second": flagged(once)}, settings)
    after, then = resolve(first, {"second": flagged(once, flag)}, settings), first.trials[1]
    (left, touched), settled = after.trials, after.groundwork.settled
    assert left.dynamics is first.trials[0].dynamics
    assert left.std is first.trials[0].std
    assert set(left.seconds.values()) == {0.0}
    assert after.skeleton.mass == first.skeleton.mass
    assert settled.gains.keys() == settled.known.keys() == {"first", "second"}
    assert np.abs(touched.motion.q - then.motion.q).max() > 1e-5
    assert touched.std is not then.std
    assert not after.held_out_due
    np.testing.assert_array_equal(touched.held_out.frames, then.held_out.frames & touched.forces_known)
    for now, before in zip(after.held_out_layouts, first.held_out_layouts, strict=True):
        np.testing.assert_array_equal(now.trials["first"].missed, before.trials["first"].missed)
    told, judged = (fit.held_out_layouts[0].trials["second"] for fit in (after, first))
    np.testing.assert_array_equal(told.ranges, judged.ranges[1:])
    np.testing.assert_array_equal(told.missed, judged.missed[1:])
    back = resolve(after, {"second": flagged(once)}, settings).trials[1]
    np.testing.assert_array_equal(back.mask.counts, then.mask.counts)
    torque = back.dynamics.joint_torques - then.dynamics.joint_torques
    assert np.abs(torque[ENDS:-ENDS]).max() < TORQUE_NM


def test_a_body_that_plates_make_heavier_bends_no_motion(two_walks):
    """All forces and torques scale with it; only a trial whose plates do not follow is made anew."""
    first, settings = two_walks
    settled, many = first.groundwork.settled, 1.5 * settings.trajectory.edit_gain
    gains = np.array([settled.gains[trial.capture.name] for trial in first.trials])

    def edited(scale: float, of_second: float = 1.0):
        weighed = MassAndGains(scale * settled.mass_kg, tuple(gains / scale * (1.0, of_second)))
        return small_edit(first.trials, weighed, first.groundwork, settings, None)

    heavier = edited(1 + many)
    assert heavier.weighed.mass_kg == (1 + many) * settled.mass_kg
    np.testing.assert_allclose(heavier.weighed.gains, gains / (1 + many))
    assert not any(frames.any() for frames in heavier.edited)
    other = edited(1 + many, 1 - many)  # its plates read as before
    assert [frames.all() for frames in other.edited] == [False, True]
    np.testing.assert_allclose(other.weighed.gains, gains / (1 + many) * (1.0, 1 - many))
    assert edited(1 + many / 3).weighed.mass_kg == settled.mass_kg
    assert edited(1 + 2 * many) is edited(1 - 2 * many) is None
    once = replace(settled, mass_kg=(1 + many) * settled.mass_kg, mass_to_all_kg=settled.mass_kg)
    before = replace(first.groundwork, settled=once)
    again = MassAndGains((1 + many) ** 2 * settled.mass_kg, tuple(gains / (1 + many)))
    assert small_edit(first.trials, again, before, settings, None) is None


def test_so_many_flags_that_nothing_is_left_leave_the_markers_motion(case):
    (name,) = case.after
    frames = case.first.trials[0].motion.frames
    reviews = {name: flagged((0, frames, None, "manualReview"))}
    alone = resolve(case.first, reviews, SETTINGS)
    assert alone.trials[0].kinematics_only is None
    np.testing.assert_array_equal(alone.trials[0].motion.q, case.first.trials[0].kinematics_only.motion.q)
    assert not alone.held_out_due
    assert alone.trials[0].std is None
    assert_agree(resolve(alone, case.before, SETTINGS), case.first)


def test_it_can_be_stopped(case):
    def stop(stage: str, fraction: float) -> None:
        raise Cancelled("stopped")

    with pytest.raises(Cancelled):
        resolve(case.first, case.after, SETTINGS, stop)
