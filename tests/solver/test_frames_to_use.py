"""Ranges of a trial and erroneous stretches: the force term, the detection and the exports leave them out.

A synthetic walker in AddBiomechanics' layout, with synthetic `trialRanges` and a synthetic review.json. Two
stances' forces are taken from the recording: one where nobody may look, one where everybody should.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.common.true_runs import runs
from solver.contact.mask import ERRONEOUS, OUTSIDE_RANGES
from solver.fitting.pipeline import can_resolve, resolve, solve
from solver.simulate.subject_folder import write_subject
from tests.conftest import MARKERS_ALONE
from tests.flagged import flagged
from tests.measured_walk import WOMAN, measured_walk

DURATION_S = 4.0
FIRST, LAST = 1.0, 3.5  # [s] trialRanges


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The walker's folder, whose recording lacks one stance before the range and one inside it."""
    recorded = measured_walk(seconds=DURATION_S)
    made = tmp_path_factory.mktemp("walker")
    write_subject(made, WOMAN, [replace(recorded, plates=_two_stances_lost(recorded.plates))])
    about = made / "_subject.json"
    entries = json.loads(about.read_text(encoding="utf-8")) | {"trialRanges": {"walk": [FIRST, LAST]}}
    about.write_text(json.dumps(entries), encoding="utf-8")
    return made


def _two_stances_lost(plates):
    """Without the first stance, and without the first one that lies well inside the range."""
    stances = sorted(
        (plate.times[start], plate.times[end - 1], k)
        for k, plate in enumerate(plates)
        for start, end in runs(plate.force_ground[:, 1] > 20)
        if end - start > 0.3 * plate.rate
    )
    inside = next(s for s in stances if s[0] > FIRST + 0.3 and s[1] < LAST - 0.5)
    lost = [stances[0], inside]
    for start, end, k in lost:
        silent = (plates[k].times >= start - 0.02) & (plates[k].times <= end + 0.02)
        gone = {
            name: np.where(silent[:, None], 0.0, getattr(plates[k], name))
            for name in ("force_ground", "moment_ground", "cop_ground")
        }
        plates = tuple(replace(p, **gone) if i == k else p for i, p in enumerate(plates))
    return plates


@pytest.fixture(scope="module")
def fit(folder):
    return solve(open_subject(folder), MARKERS_ALONE)


def outside_of(trial):
    times = trial.motion.times
    return (times < FIRST - 1e-6) | (times > LAST + 1e-6)


def frames_of(ranges, frames):
    flags = np.zeros(frames, dtype=bool)
    for start, end in ranges:
        flags[start:end] = True
    return flags


def test_no_force_outside_the_range_is_used_and_the_fit_says_so(fit):
    (trial,) = fit.trials
    outside = outside_of(trial)
    listed = [(start, end) for start, end, foot, why in trial.mask.reasons if why == OUTSIDE_RANGES]
    np.testing.assert_array_equal(frames_of(listed, trial.motion.frames), outside)
    assert not trial.forces_known[outside].any()
    assert trial.forces_known[~outside].any()
    assert not trial.dynamics.used[outside].any()
    assert any("outside trialRanges (1 to 3.5 s)" in note for note in trial.capture.notes)


def test_detection_speaks_of_the_range_alone_and_still_finds_the_stance_inside(fit):
    (trial,) = fit.trials
    proposed = frames_of([p.range for p in trial.proposals], trial.motion.frames)
    assert not proposed[outside_of(trial)].any()
    assert proposed[~outside_of(trial)].any()


def test_without_the_range_both_stances_are_found(fit, folder):
    subject = open_subject(folder)
    whole = replace(subject, trials=tuple(replace(t, ranges=()) for t in subject.trials))
    (trial,) = solve(whole, MARKERS_ALONE).trials
    proposed = frames_of([p.range for p in trial.proposals], trial.motion.frames)
    assert proposed[outside_of(trial)].any()
    assert not any(why == OUTSIDE_RANGES for *_, why in trial.mask.reasons)


def test_a_review_json_does_not_bring_them_back(folder, fit, tmp_path):
    frames = fit.trials[0].motion.frames
    place = tmp_path / "segment_1"
    place.mkdir()
    labels = [150 <= frame < 160 for frame in range(frames)]
    (place / "review.json").write_text(json.dumps({"missing_grf_data": labels}), encoding="utf-8")
    subject = open_subject(folder)
    reviewed = replace(
        subject, trials=tuple(replace(t, reviews=(place / "review.json",)) for t in subject.trials)
    )
    (trial,) = solve(reviewed, MARKERS_ALONE).trials
    assert trial.mask.source == "review.json"
    expected = outside_of(trial) | np.array(labels)
    np.testing.assert_array_equal(~trial.mask.all_feet, expected)


def test_another_range_is_another_fit(fit, folder):
    subject = open_subject(folder)
    assert can_resolve(fit, subject, subject.trials, MARKERS_ALONE)
    moved = tuple(replace(t, ranges=((FIRST, LAST - 0.5),)) for t in subject.trials)
    assert not can_resolve(fit, subject, moved, MARKERS_ALONE)


def test_an_erroneous_stretch_is_left_out_by_name_and_is_no_evidence(fit):
    (trial,) = fit.trials
    (start, end) = next(p.range for p in trial.proposals)
    stretch = (start - 5, end + 5, None, ERRONEOUS)
    again = resolve(fit, {"walk": flagged(stretch)}, MARKERS_ALONE)
    (without,) = again.trials
    assert stretch in without.mask.reasons
    assert not without.forces_known[start - 5 : end + 5].any()
    assert not frames_of([p.range for p in without.proposals], trial.motion.frames)[start:end].any()
    (back,) = resolve(again, {}, MARKERS_ALONE).trials
    assert back.proposals == trial.proposals


def test_forces_of_an_erroneous_stretch_teach_nothing_about_the_rest_of_the_contact(fit, folder):
    """Most of a stance twofold: as it is, all of it is called wrong; without that part, nothing is."""
    (files,) = open_subject(folder).trials
    (trial,) = fit.trials
    start, end = _sound_stance(trial)
    wrong = start + round(0.7 * (end - start))
    capture = read_trial(files)
    times = capture.markers.times[[start, wrong - 1]]
    spoilt = {"walk": replace(capture, plates=tuple(_twofold(plate, times) for plate in capture.plates))}
    reviews = {"walk": flagged((start - 3, wrong + 3, None, ERRONEOUS))}

    def proposed_after(**given):
        (solved,) = solve(open_subject(folder), MARKERS_ALONE, captures=spoilt, **given).trials
        return frames_of([p.range for p in solved.proposals], trial.motion.frames)[wrong + 3 : end - 3]

    assert proposed_after().all()
    assert not proposed_after(reviews=reviews).any()


def _sound_stance(trial):
    """One foot's stance well inside the range and away from every proposal."""
    proposed = frames_of([p.range for p in trial.proposals], trial.motion.frames)
    for foot in range(2):
        for start, end in runs(trial.contacts.in_contact[:, foot]):
            inside = trial.motion.times[start] > FIRST and trial.motion.times[end - 1] < LAST
            if inside and end - start > 40 and not proposed[start:end].any():
                return start, end
    raise AssertionError("the walker has no stance to spoil")


def _twofold(plate, span):
    between = (plate.times >= span[0]) & (plate.times <= span[1])
    gain = np.where(between, 2.0, 1.0)[:, None]
    return replace(plate, force_ground=plate.force_ground * gain, moment_ground=plate.moment_ground * gain)
