"""Copies of a recording, and recordings that are as like it as another one can be."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from addb_viewer.dataset.same_recording import Places, recording_of, same_recordings
from solver.capture.subject.opened_subject import subjects_in
from solver.capture.trial import read_trial
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.skeleton.scaling import with_offsets


@pytest.fixture(scope="module")
def walker():
    return body_of(Person(70.0, 1.75), np.random.default_rng(11))


@pytest.fixture(scope="module")
def walks(walker):
    """Two walks of one person at one speed: the hardest that is no copy."""
    rng = np.random.default_rng(2)
    return [simulate_trial(Scenario("w", "walk", 2.4, 1.3), walker, rng) for _ in range(2)]


def shown(name, body, motion, noise=0.0, *, seed=0, seen=slice(None)):
    """A trial of a motion."""
    rng = np.random.default_rng(seed)
    markers = body.markers(motion.q)
    places = Places(motion.times, (markers + noise * rng.standard_normal(markers.shape))[:, seen])
    return recording_of(name, body.skeleton.marker_names[seen], places, lambda: places)


def named_pairs(*recordings):
    return [(one.trial_id, other.trial_id) for one, other in same_recordings(recordings)]


def cut(walk, rate, first, last):
    motion = walk.frames(rate)
    return replace(motion, q=motion.q[round(first * rate) : round(last * rate)])


@pytest.mark.slow
@pytest.mark.parametrize(
    "how",
    [(100.0, 0.0, 2.4, 0.0), (100.0, 0.7, 2.4, 0.0002), (150.0, 0.0, 1.6, 0.0002), (60.0, 0.4, 2.0, 0.0002)],
)
def test_a_copy_is_found_cut_shifted_resampled_and_with_noise(walker, walks, how):
    rate, first, last, noise = how
    whole = shown("a", walker, walks[0].frames(100.0))
    copy = shown("b", walker, cut(walks[0], rate, first, last), noise)
    assert named_pairs(whole, copy) == [("a", "b")]


def test_a_copy_is_found_with_a_part_of_its_markers_and_with_gaps(walker, walks):
    whole = shown("a", walker, walks[0].frames(100.0))
    copy = shown("b", walker, cut(walks[0], 120.0, 0.3, 2.1), 0.0002, seen=slice(0, 30))
    places = copy.again()
    places.markers[60:90, ::3] = np.nan
    again = recording_of("b", copy.labels, places, lambda: places)
    assert named_pairs(whole, again) == [("a", "b")]


def test_a_copy_without_a_stretch_in_its_middle_is_found(walker, walks):
    whole = shown("a", walker, walks[0].frames(100.0))
    kept = np.r_[0:70, 130:240]
    places = Places(walks[0].frames(100.0).times[kept], walker.markers(walks[0].frames(100.0).q)[kept])
    copy = recording_of("b", walker.skeleton.marker_names, places, lambda: places)
    assert named_pairs(whole, copy) == [("a", "b")]


def test_another_walk_of_the_same_person_at_the_same_speed_is_no_copy(walker, walks):
    assert named_pairs(*(shown(n, walker, w.frames(100.0)) for n, w in zip("ab", walks, strict=True))) == []


def test_one_part_of_a_walk_is_no_copy_of_the_next(walker, walks):
    parts = [cut(walks[0], 100.0, *span) for span in ((0.0, 1.15), (1.15, 2.4))]
    assert named_pairs(*(shown(n, walker, part) for n, part in zip("ab", parts, strict=True))) == []


def test_the_same_movement_with_markers_put_on_anew_is_no_copy(walker, walks):
    """It is how a second session of the same person looks at best."""
    offsets = 0.01 * np.random.default_rng(5).standard_normal((len(walker.skeleton.markers), 3))
    anew = replace(walker, skeleton=with_offsets(walker.skeleton, offsets))
    motion = walks[0].frames(100.0)
    assert named_pairs(shown("a", walker, motion), shown("b", anew, motion)) == []


def test_two_quiet_stances_of_one_person_are_no_copies(walker, walks):
    stood = replace(walks[0].frames(100.0), q=np.tile(walks[0].frames(100.0).q[:1], (200, 1)))
    assert (
        named_pairs(*(shown(name, walker, stood, 0.0005, seed=seed) for seed, name in enumerate("ab"))) == []
    )


def test_the_same_markers_elsewhere_under_other_names_are_the_same_content(walker, walks):
    one = shown("a", walker, walks[0].frames(100.0))
    places, order = one.again(), np.random.default_rng(1).permutation(len(one.labels))
    moved = Places(places.times, places.markers[:, order] + np.array([3.0, 0.1, -2.0]))
    other = recording_of("b", [f"M{k}" for k in range(len(order))], moved, lambda: moved)
    assert named_pairs(one, other) == [("a", "b")]


def test_all_of_three_equal_recordings_are_told_whatever_their_names(walker, walks):
    one = shown("a", walker, walks[0].frames(100.0))
    others = [replace(one, trial_id=name, labels=tuple(name + m for m in one.labels)) for name in "bc"]
    assert named_pairs(one, *others) == [("a", "b"), ("a", "c"), ("b", "c")]


def test_real_recordings_that_were_handed_over_twice(real_data):
    """One in a folder and in a B3D file, one under two names with clocks 4 ms apart; beside others."""
    found = []
    for place in ("opencap_subject4", "b3d", "sprint_overground_dorn2012_JA1_9ms"):
        (subject,) = subjects_in(real_data / place)[0]
        for trial in subject.trials:
            if trial.name not in ("DJ1", "STS1", "squats1"):
                found.append((f"{place}/{trial.name}", read_trial(trial, mass_kg=subject.mass_kg).markers))
    recordings = []
    for name, markers in found:
        places = Places(np.arange(markers.frames) / markers.rate, markers.positions_ground)
        recordings.append(recording_of(name, markers.names, places, partial(lambda kept: kept, places)))
    assert {frozenset(pair) for pair in named_pairs(*recordings)} == {
        frozenset(("opencap_subject4/walking1", "b3d/walking1")),
        frozenset(f"sprint_overground_dorn2012_JA1_9ms/{name}" for name in ("run0900cms", "JA1Gait35")),
    }
    assert len(recordings) == 6
