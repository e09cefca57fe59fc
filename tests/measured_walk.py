"""A walk that nobody took, as a laboratory measures it."""

import numpy as np

from solver.capture.capture import Capture
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial

WOMAN = Person(sex="female")


def measured_walk(who: Person = WOMAN, *, seconds: float = 2.3, seed: int = 5, **equipment: float) -> Capture:
    """The trial `walk`, every step of it on a plate; `equipment` as in `MeasurementSettings`."""
    body_rng, motion_rng, noise_rng = np.random.default_rng(seed).spawn(3)
    trial = simulate_trial(Scenario("walk", "walk", duration=seconds), body_of(who, body_rng), motion_rng)
    plates = plates_under(trial.contacts, (0.0, seconds))
    return measure(trial, plates, MARKERS, MeasurementSettings(**equipment), noise_rng)
