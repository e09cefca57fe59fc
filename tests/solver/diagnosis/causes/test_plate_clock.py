"""One plate whose samples come late, the others in time."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.clocks import PlateClock
from solver.diagnosis.causes.effect import Fitted


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
def test_the_true_wrench_comes_back(walk_capture, seen, samples):
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


def test_estimates_bounds_and_the_practical_minimum(walk_capture, seen):
    scene = seen(walk_capture)
    candidate, nothing = PlateClock("plate_1"), (np.zeros(0), np.zeros((0, 0)))
    estimate = candidate.estimates([scene], Fitted((0.02,), (0.001,), *nothing))
    assert (estimate["offset_s"].value, estimate["offset_s"].std) == (0.02, 0.001)
    assert candidate.is_notable(estimate)
    assert not candidate.is_notable(candidate.estimates([scene], Fitted((-0.003,), (0.001,), *nothing)))
    assert all(candidate.admissible(eta) for eta in candidate.starts([scene]))
    assert not candidate.admissible((0.5,))


def test_each_plate_is_a_candidate_where_there_are_several(walk_capture, seen):
    scene = seen(walk_capture)
    loaded = [p.target for p in scene.plates if p.loaded.any()]
    assert [c.target for c in PlateClock.candidates([scene, scene])] == loaded
    assert PlateClock.candidates([replace(scene, plates=scene.plates[:1])]) == []
