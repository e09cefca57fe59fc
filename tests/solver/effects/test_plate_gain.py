"""A plate with a wrong gain, put right at any size."""

from dataclasses import replace

import numpy as np
import pytest

from solver.effects.plate_gain import PlateGain, candidates


def recorded(capture, gain_error, k=1):
    plates = list(capture.plates)
    wrong = 1 + gain_error
    plates[k] = replace(
        plates[k],
        force_ground=wrong * plates[k].force_ground,
        moment_ground=wrong * plates[k].moment_ground,
    )
    return replace(capture, plates=tuple(plates))


@pytest.mark.parametrize("gain_error", [0.04, -0.2])
def test_the_true_wrench_comes_back_whatever_the_size(crisp, seen, gain_error):
    scene = seen(recorded(crisp, gain_error))
    candidate = PlateGain("plate_2")
    x = np.array([1 / (1 + gain_error) - 1])
    columns = candidate.signature(scene, ()).columns
    np.testing.assert_allclose(scene.measured_ground + columns @ x, seen(crisp).measured_ground, atol=1e-9)
    estimate = candidate.estimates([scene], (), (), x, np.array([[0.01**2]]))["gain_error"]
    assert estimate.value == pytest.approx(gain_error)
    step = 1e-6
    slope = (1 / (1 + x[0] + step) - 1 / (1 + x[0] - step)) / (2 * step)
    assert estimate.std == pytest.approx(abs(slope) * 0.01)


def test_every_loaded_plate_is_a_candidate_and_no_other_trial_is_touched(crisp, seen):
    scene = seen(crisp)
    made = candidates([scene])
    assert [c.target for c in made] == [p.target for p in scene.plates]
    assert made[0].signature(replace(scene, plates=scene.plates[1:]), ()) is None


def test_a_hundredth_is_not_worth_a_word(crisp, seen):
    candidate = PlateGain("plate_1")
    for x, notable in ((-0.01, False), (-0.04, True), (0.04, True)):
        assert candidate.is_notable(candidate.estimates([], (), (), np.array([x]), np.eye(1))) is notable
