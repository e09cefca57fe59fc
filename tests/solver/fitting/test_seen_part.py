"""A person who is in view for a part of a recording is solved as if nothing else had been recorded."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject, read_trials
from solver.common import typed_json
from solver.contact.force_review import ForceLabel, ForceReview
from solver.export.opensim import export_opensim
from solver.fitting.pipeline import resolve, solve
from solver.fitting.results.store import load_fit, save_fit
from solver.fitting.summary import all_notes, summary
from solver.gait.settings import GAIT
from solver.gait.trial_gait import gait_of
from solver.kinematics.determined import left_open
from solver.simulate.subject_folder import write_subject
from tests.conftest import NO_HELD_OUT as SETTINGS
from tests.measured_walk import WOMAN, measured_walk

pytestmark = pytest.mark.slow  # their fixtures take long

BEFORE, AFTER, SECONDS = 700, 40, 1.6


@pytest.fixture(scope="module")
def subject(tmp_path_factory):
    folder = tmp_path_factory.mktemp("walker")
    write_subject(folder, WOMAN, [measured_walk(seconds=SECONDS)])
    return open_subject(folder)


def walk_of(subject):
    return read_trials(subject, list(subject.trials), SETTINGS.reading).captures[0]


def with_empty_ends(capture, seen_there=()):
    """The same, with frames before and after on which at most some markers are seen."""
    markers = capture.markers
    x = np.pad(markers.positions_ground, ((BEFORE, AFTER), (0, 0), (0, 0)), constant_values=np.nan)
    for name in seen_there:
        column = markers.names.index(name)
        x[:BEFORE, column] = markers.positions_ground[0, column]
        x[-AFTER:, column] = markers.positions_ground[-1, column]
    start = markers.start_time - BEFORE / markers.rate
    return replace(capture, markers=replace(markers, positions_ground=x, start_time=start))


@pytest.fixture(scope="module")
def plain(subject):
    return solve(subject, SETTINGS)


@pytest.fixture(scope="module", params=[(), ("RHEE", "RTOE", "RANK")], ids=["nobody", "a foot"])
def padded(request, subject):
    walk = walk_of(subject)
    return solve(subject, SETTINGS, captures={walk.name: with_empty_ends(walk, request.param)})


def seen(fit):
    return slice(BEFORE, fit.trials[0].motion.frames - AFTER)


def test_frames_that_show_nobody_have_no_pose_and_no_force(padded):
    trial = padded.trials[0]
    outside = np.ones(trial.motion.frames, dtype=bool)
    outside[seen(padded)] = False
    for motion in (trial.motion, trial.kinematics_only.motion, trial.dynamics.motion):
        assert np.array_equal(~motion.posed, outside)
    assert np.isnan(trial.dynamics.joint_torques[outside]).all()
    assert np.isnan(trial.dynamics.com_ground[outside]).all()
    assert not (trial.dynamics.used | trial.forces_known)[outside].any()
    assert not trial.contacts.wrench_ground[outside].any()
    assert all(not outside[slice(*p.range)].any() for p in trial.proposals)


def test_the_rest_is_as_if_they_had_not_been_recorded(plain, padded):
    one, other = plain.trials[0], padded.trials[0]
    part = seen(padded)
    np.testing.assert_allclose(other.motion.q[part], one.motion.q, atol=1e-6)
    np.testing.assert_allclose(other.dynamics.joint_torques[part], one.dynamics.joint_torques, atol=1e-3)
    np.testing.assert_array_equal(other.dynamics.used[part], one.dynamics.used)
    assert padded.mass_kg == pytest.approx(plain.mass_kg, rel=1e-6)
    events = [gait_of(f.trials[0], f.skeleton, GAIT, SETTINGS.conditioning).events for f in (plain, padded)]
    assert [(e.foot, e.kind) for e in events[0]] == [(e.foot, e.kind) for e in events[1]]
    np.testing.assert_allclose([e.time_s for e in events[1]], [e.time_s for e in events[0]], atol=1e-3)


ARM = {"RELB", "RELM", "RFRM", "RWRA", "RWRB", "RFIN"}


@pytest.mark.parametrize("frames", [slice(40, 90), slice(None)], ids=["for a while", "all along"])
def test_a_joint_is_open_where_the_markers_that_other_frames_or_recordings_have_would_show_it(plain, frames):
    trial, match = plain.trials[0], plain.groundwork.match
    skeleton, observed = match.skeleton(plain.skeleton), match.observed(trial.capture.markers)
    before = left_open(skeleton, observed, trial.motion.q, SETTINGS.kinematics)
    hidden = [k for k, spellings in enumerate(match.measured) if ARM & set(spellings)]
    observed[frames, hidden] = np.nan
    after = left_open(skeleton, observed, trial.motion.q, SETTINGS.kinematics)
    opened = {dof for dof, there in zip(skeleton.dofs, (after & ~before).T, strict=True) if there.any()}
    assert {"elbow_flex_r", "pro_sup_r"} <= opened
    assert not any(dof.endswith("_l") or "knee" in dof or "hip" in dof or "pelvis" in dof for dof in opened)
    elbow = after[:, skeleton.dofs.index("elbow_flex_r")]
    assert elbow[frames].all()
    assert elbow.sum() == len(elbow[frames])


def test_notes_and_figures_tell_the_range(padded, plain):
    frames = padded.trials[0].motion.frames
    (told,) = (note for note in all_notes(padded) if "no pose on" in note)
    assert f"0-{BEFORE - 1}" in told
    assert f"{frames - AFTER}-{frames - 1}" in told
    (trial,) = typed_json.plain(summary(padded))["trials"]
    assert trial["frames_without_pose_ranges"] == [[0, BEFORE], [frames - AFTER, frames]]
    (whole,) = typed_json.plain(summary(plain))["trials"]
    assert whole["frames_without_pose_ranges"] == []


def test_flags_count_frames_from_the_recordings_beginning(subject, plain, padded):
    name, start = plain.trials[0].capture.name, 60
    flags = [ForceLabel(a, a + 20, None, "manualReview") for a in (start, start + BEFORE)]
    one, other = (
        resolve(fit, {name: ForceReview(by_people=(flag,))}, SETTINGS).trials[0]
        for fit, flag in zip((plain, padded), flags, strict=True)
    )
    part = seen(padded)
    np.testing.assert_array_equal(other.mask.counts[part], one.mask.counts)
    assert not other.mask.counts[flags[1].start : flags[1].end].any()
    assert tuple(flags[1]) in other.mask.reasons
    np.testing.assert_allclose(other.motion.q[part], one.motion.q, atol=2e-3)


def test_a_kept_fit_and_its_export_leave_them_out(padded, tmp_path):
    save_fit(padded, tmp_path / "results")
    again = load_fit(tmp_path / "results", padded.subject.folder)
    np.testing.assert_array_equal(again.trials[0].motion.q, padded.trials[0].motion.q)
    files = export_opensim(padded, tmp_path / "opensim")
    (motion,) = (f for f in files if f.name.endswith("_ik.mot"))
    rows = [line.split("\t") for line in motion.read_text().splitlines() if line[:1].isdigit()]
    trial = padded.trials[0]
    assert len(rows) == trial.motion.posed.sum()
    assert float(rows[0][0]) == pytest.approx(trial.motion.times[BEFORE])
    assert "nan" not in motion.read_text()
