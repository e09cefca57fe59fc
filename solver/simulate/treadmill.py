"""Walking on the spot: the same motion over a belt that runs backwards, and a plate under each belt."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.capture.capture import ForcePlate
from solver.simulate.feasible_motion import PLACE
from solver.simulate.laboratory import MeasurementSettings, Plate, read_out
from solver.simulate.simulated_trial import SyntheticTrial
from solver.simulate.spline_motion import DEGREE, SplineMotion

BELT_GAP_M = 0.01  # between the belts


@dataclass(frozen=True)
class Belt:
    """How the frame of a walk over ground moves past the laboratory's; they coincide at `meets`."""

    velocity_ground: Float[np.ndarray, "3"]  # [m/s]
    meets: float  # [s]

    def displacement(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 3"]:
        """Of whatever stands on the belt [m]."""
        return (times[:, None] - self.meets) * self.velocity_ground

    def carry(self, motion: SplineMotion) -> SplineMotion:
        """A motion over ground as it looks in the laboratory.

        A line is the spline whose coefficients are its values at the Greville points, the means of the five
        knots inside each basis function.
        """
        coefficients = motion.coefficients.copy()
        index = np.arange(len(coefficients))
        greville = motion.start + (index - (DEGREE - 1) / 2) * motion.spacing
        line = self.displacement(greville)
        for axis, name in enumerate(PLACE):
            coefficients[:, motion.dofs.index(name)] += line[:, axis]
        return replace(motion, coefficients=coefficients)


def belt_under(trial: SyntheticTrial, speed: float) -> Belt:
    """The belt [m/s towards -x] on which a walk along +x is in its place halfway through the trial."""
    return Belt(np.array([-speed, 0.0, 0.0]), trial.scenario.duration / 2)


def on_treadmill(trial: SyntheticTrial, belt: Belt) -> SyntheticTrial:
    """A walk as it looks from beside the belt; the forces are the same, since the belt's speed is constant.

    Args:
        trial: over ground, without anything that acts on the person but the ground.
        belt: that carries it.
    """
    if trial.external is not None:
        raise ValueError(
            "what acts on the person has to be stated beside the belt, after the change of frame"
        )
    contacts = trial.contacts.moved(0.0, -belt.meets * belt.velocity_ground)
    contacts = replace(contacts, belt_velocity=contacts.belt_velocity + belt.velocity_ground)
    return replace(trial, motion=belt.carry(trial.motion), contacts=contacts)


def belts(
    length: float = 1.8, width: float = 0.5, centre: tuple[float, float] = (0.0, 0.0)
) -> tuple[Plate, Plate]:
    """The plates under a right and a left belt."""
    aside = (width + BELT_GAP_M) / 2
    right, left = (
        Plate((centre[0], centre[1] + side * aside), length / 2, width / 2) for side in (1.0, -1.0)
    )
    return right, left


def read_belts(
    trial: SyntheticTrial,
    plates: tuple[Plate, Plate],
    settings: MeasurementSettings,
    rng: np.random.Generator,
) -> tuple[ForcePlate, ForcePlate]:
    """What the plates read when each foot keeps to its own belt: right, left.

    Args:
        trial: what happened.
        plates: under the right and the left foot.
        settings: of the equipment.
        rng: of its noise.
    """
    times = np.arange(round(trial.scenario.duration * settings.force_rate) + 1) / settings.force_rate
    feet = trial.reactions(times).wrench_ground
    right, left = (
        read_out(f"ground_force_{foot + 1}", plate, feet[:, foot], settings, rng)
        for foot, plate in enumerate(plates)
    )
    return right, left
