"""Forces that come late or early: of all plates, of one, of each trial; or sampled at another rate."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.about import Reading, of_each_trial
from solver.diagnosis.causes.clocks import (
    MOST_TRIALS,
    TARGET,
    ClockOffset,
    PlateClock,
    SampleRate,
    TrialClocks,
)
from solver.diagnosis.causes.effect import Fitted


@pytest.mark.parametrize("offset_s", [0.0123, -0.04])
def test_the_true_wrench_comes_back(on_one_plate, seen, offset_s):
    late = seen(on_one_plate(lambda times: times - offset_s))
    true = seen(on_one_plate(lambda times: times)).measured_ground
    fixed = ClockOffset("all").signature(late, (offset_s,)).fixed
    inside = slice(20, -20)  # the filter's ends are its own
    left = (late.measured_ground + fixed - true)[inside]
    was = (late.measured_ground - true)[inside]
    assert np.sqrt((left**2).mean()) < 1e-4 * np.sqrt((was**2).mean())


def test_where_nothing_was_recorded_a_shift_explains_nothing(on_one_plate, seen):
    scene = seen(on_one_plate(lambda times: times - 0.1))
    fixed = ClockOffset("all").signature(scene, (0.1,)).fixed
    np.testing.assert_array_equal(fixed[-9:], 0)
    assert np.abs(fixed[:-10]).max() > 1


@pytest.mark.parametrize("offset_s", [0.003, -0.006, 0.011, -0.022, 0.045, 0.08, -0.13])
def test_one_start_lies_nearer_to_any_offset_than_no_shift(on_one_plate, seen, offset_s):
    """Candidates are screened at their starts: none of them would do better than nothing otherwise."""
    late = seen(on_one_plate(lambda times: times - offset_s))
    true = seen(on_one_plate(lambda times: times)).measured_ground
    (candidate,) = ClockOffset.candidates([late])
    with_evidence = ~np.any([candidate.unrecorded(late, eta) for eta in candidate.starts([late])], axis=0)
    without = ((late.measured_ground - true)[with_evidence] ** 2).sum()
    left = [
        (((late.measured_ground + candidate.signature(late, eta).fixed) - true)[with_evidence] ** 2).sum()
        for eta in candidate.starts([late])
    ]
    assert min(left) < 0.7 * without


@pytest.mark.parametrize("stretch", [0.01, -0.02])
def test_the_true_wrench_comes_back_at_another_rate(on_one_plate, seen, stretch):
    """But for the filter, whose cutoff is stretched, too."""
    drifting = seen(on_one_plate(lambda times: times / (1 + stretch)))
    true = seen(on_one_plate(lambda times: times)).measured_ground
    fixed = SampleRate("all").signature(drifting, (stretch,)).fixed
    inside = slice(20, -20)
    left = (drifting.measured_ground + fixed - true)[inside]
    was = (drifting.measured_ground - true)[inside]
    assert np.sqrt((left**2).mean()) < 0.02 * np.sqrt((was**2).mean())


def test_where_nothing_was_recorded_a_stretch_explains_nothing(on_one_plate, seen):
    scene = seen(on_one_plate(lambda times: times / 1.04))
    fixed = SampleRate("all").signature(scene, (0.04,)).fixed
    unrecorded = 1.04 * scene.times > scene.times[-1] + 0.001
    assert unrecorded.sum() > 5
    np.testing.assert_array_equal(fixed[unrecorded], 0)
    assert np.abs(fixed[~unrecorded]).max() > 1


def test_starts_lie_as_close_as_the_longest_trial_needs(on_one_plate, seen):
    scene = seen(on_one_plate(lambda times: times))
    (candidate,) = SampleRate.candidates([scene])
    starts = np.array(candidate.starts([scene]))[:, 0]
    assert np.diff(starts).max() * scene.times[-1] <= 0.06
    assert starts.min() <= -0.02
    assert starts.max() >= 0.02
    assert 0.0 in starts
    assert all(candidate.admissible(eta) for eta in candidate.starts([scene]))
    assert not candidate.admissible((0.1,))


def one_late(capture, k, samples):
    """The plate's samples, so many later; the first stays until then."""

    def later(values):
        return np.concatenate([np.repeat(values[:1], samples, axis=0), values[:-samples]])

    plates = list(capture.plates)
    plates[k] = replace(
        plates[k],
        force_ground=later(plates[k].force_ground),
        moment_ground=later(plates[k].moment_ground),
        cop_ground=later(plates[k].cop_ground),
    )
    return replace(capture, plates=tuple(plates))


@pytest.mark.parametrize("samples", [12, 45])
def test_the_true_wrench_comes_back_of_one_plate(walk_capture, seen, samples):
    offset_s = samples / walk_capture.plates[1].rate
    late, true = seen(one_late(walk_capture, 1, samples)), seen(walk_capture).measured_ground
    fixed = PlateClock("plate_2").signature(late, (offset_s,)).fixed
    inside = slice(20, -20)  # the filter's ends are its own
    left = (late.measured_ground + fixed - true)[inside]
    was = (late.measured_ground - true)[inside]
    assert np.sqrt((left**2).mean()) < 1e-3 * np.sqrt((was**2).mean())


def test_a_shift_says_nothing_of_other_plates_nor_beyond_the_recording(walk_capture, seen):
    scene = seen(walk_capture)
    candidate = PlateClock("plate_2")
    unrecorded = candidate.unrecorded(scene, (0.1,))
    np.testing.assert_array_equal(np.flatnonzero(unrecorded), np.arange(scene.frames - 10, scene.frames))
    np.testing.assert_array_equal(candidate.signature(scene, (0.1,)).fixed[unrecorded], 0.0)
    alone = replace(scene, plates=tuple(p for p in scene.plates if p.target != "plate_2"))
    assert candidate.signature(alone, (0.1,)) is None
    assert not candidate.unrecorded(alone, (0.1,)).any()


def test_each_plate_is_a_candidate_where_there_are_several(walk_capture, seen):
    scene = seen(walk_capture)
    loaded = [p.target for p in scene.plates if p.loaded.any()]
    assert [c.target for c in PlateClock.candidates([scene, scene])] == loaded
    assert PlateClock.candidates([replace(scene, plates=scene.plates[:1])]) == []


LATE = {"walk": 0.012, "again": -0.03}


@pytest.fixture(scope="module")
def late_trials(on_one_plate, seen):
    return {
        name: replace(seen(on_one_plate(lambda times, late=late: times - late)), name=name)
        for name, late in LATE.items()
    }


def test_the_true_wrench_comes_back_in_each_trial(late_trials, on_one_plate, seen):
    true = seen(on_one_plate(lambda times: times)).measured_ground
    (candidate,) = TrialClocks.candidates(list(late_trials.values()))
    eta = tuple(LATE[name] for name in candidate.trials)
    inside = slice(20, -20)  # the filter's ends are its own
    for scene in late_trials.values():
        left = (scene.measured_ground + candidate.signature(scene, eta).fixed - true)[inside]
        was = (scene.measured_ground - true)[inside]
        assert np.sqrt((left**2).mean()) < 1e-4 * np.sqrt((was**2).mean())


def test_other_trials_are_left_alone_and_ends_unrecorded(late_trials):
    candidate = TrialClocks(TARGET, ("walk", "again"))
    strange = replace(late_trials["walk"], name="third")
    assert candidate.signature(strange, (0.1, 0.0)) is None
    assert not candidate.unrecorded(strange, (0.1, 0.0)).any()
    assert candidate.unrecorded(late_trials["walk"], (0.1, 0.0))[-9:].all()
    assert not candidate.unrecorded(late_trials["again"], (0.1, 0.0)).any()


def test_each_trials_offset_is_told(late_trials):
    scenes = list(late_trials.values())
    (candidate,) = TrialClocks.candidates(scenes)
    nothing = np.zeros(0), np.zeros((0, 0))
    found = candidate.estimates(scenes, Fitted((0.012, -0.03), (0.001, 0.002), *nothing))
    assert {n: (e.value, e.std) for n, e in found.items()} == {
        "offset_s walk": (0.012, 0.001),
        "offset_s again": (-0.03, 0.002),
    }
    assert candidate.is_notable(found)
    alike = candidate.estimates(scenes, Fitted((0.012, 0.013), (0.001, 0.002), *nothing))
    assert not candidate.is_notable(alike)  # one clock
    said = [r for r in of_each_trial(TrialClocks.about.readings, found) if isinstance(r, Reading)]
    assert [r.parameter for r in said] == list(found)
    assert "again" in said[1].text
    assert all(candidate.admissible(eta) for eta in candidate.starts(scenes))
    assert not candidate.admissible((0.0, 0.5))


def test_one_trial_has_a_clock_and_many_are_too_many(late_trials):
    scene = late_trials["walk"]
    many = [replace(scene, name=f"trial {k}") for k in range(MOST_TRIALS + 1)]
    assert TrialClocks.candidates([scene]) == []
    assert TrialClocks.candidates(many) == []
    assert TrialClocks.candidates(many[:-1])[0].trials == tuple(s.name for s in many[:-1])
