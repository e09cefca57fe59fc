"""A plate with a wrong gain, corrected at any size."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.plate_readings import PlateGain


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
def test_the_true_wrench_comes_back_at_any_size_while_the_plate_stands_alone(crisp, seen, gain_error):
    """Within what unloaded plates read; but for a share of the error while another carries some weight."""
    exact = seen(crisp)
    exact = replace(exact, required_ground=exact.measured_ground)
    scene = replace(seen(recorded(crisp, gain_error)), required_ground=exact.measured_ground)
    candidate, x = PlateGain("plate_2"), np.array([gain_error])
    told = candidate.signature(scene, ()).columns @ x
    error = exact.measured_ground - scene.measured_ground
    others = np.any([p.loaded for p in scene.plates if p.target != "plate_2"], axis=0)
    alone = scene.plates[1].loaded & ~others
    assert alone.sum() > 20
    np.testing.assert_allclose(told[alone], error[alone], atol=0.01 * np.abs(error).max())
    assert np.abs(told[~scene.plates[1].loaded]).max() < 0.01 * np.abs(error).max()
    with_others = scene.plates[1].loaded & others
    assert np.abs((told - error)[with_others]).max() <= abs(gain_error) * np.abs(error).max()
    estimate = candidate.estimates([scene], Fitted((), (), x, np.array([[0.01**2]])))["gain_error"]
    assert (estimate.value, estimate.std) == (gain_error, pytest.approx(0.01))


def test_noise_of_the_plates_alone_makes_no_gain(crisp, seen):
    """What the fitted motion does not tell is part of what plates record, and has nothing to do with it."""
    exact = seen(crisp)
    rng = np.random.default_rng(3)
    factors = []
    for _ in range(40):
        noise = 60.0 * rng.standard_normal((exact.frames, 6)) * exact.plates[1].loaded[:, None]
        plates = list(exact.plates)
        plates[1] = replace(plates[1], wrench_ground=plates[1].wrench_ground + noise)
        scene = replace(exact, plates=tuple(plates), required_ground=exact.measured_ground)
        column = PlateGain("plate_2").signature(scene, ()).columns[:, :3, 0].ravel()
        left = (scene.required_ground - scene.measured_ground)[:, :3].ravel()
        factors.append(-column @ left / (column @ column))
    spread = np.std(factors) / np.sqrt(len(factors))
    assert abs(np.mean(factors)) < 3 * spread


def test_a_force_that_something_else_took_is_not_counted_as_the_plates(crisp, seen):
    """Where hardly anything of the demand was recorded, the record is as good."""
    exact = seen(crisp)
    lost = replace(exact, required_ground=2.5 * exact.measured_ground)
    own = PlateGain("plate_2").signature(lost, ()).columns[:, :, 0]
    np.testing.assert_allclose(own, -lost.plates[1].wrench_ground)


def test_every_loaded_plate_is_a_candidate_and_no_other_trial_is_touched(crisp, seen):
    scene = seen(crisp)
    made = PlateGain.candidates([scene])
    assert [c.target for c in made] == [p.target for p in scene.plates]
    assert made[0].signature(replace(scene, plates=scene.plates[1:]), ()) is None


def test_a_hundredth_is_not_worth_a_word(crisp, seen):
    candidate = PlateGain("plate_1")
    for x, notable in ((-0.01, False), (-0.04, True), (0.04, True)):
        assert (
            candidate.is_notable(candidate.estimates([], Fitted((), (), np.array([x]), np.eye(1)))) is notable
        )
