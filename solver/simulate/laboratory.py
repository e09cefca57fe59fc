"""Force plates in the floor, and what they and the cameras make of a trial."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.simulate.contacts import ContactPlan, Stance, about_vertical
from solver.simulate.simulated_trial import SyntheticTrial
from solver.skeleton.forward import cross


@dataclass(frozen=True)
class Plate:
    """A rectangle in the floor: centre (x, z), half sizes along its own axes, turned about +y."""

    centre: tuple[float, float]  # [m]
    half_length: float  # [m] along x before turning
    half_width: float  # [m]
    yaw: float = 0.0  # [rad]

    @property
    def corners_ground(self) -> Float[np.ndarray, "4 3"]:
        """Corners in order around the plate [m]."""
        signs = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)])
        flat = np.zeros((4, 3))
        flat[:, 0], flat[:, 2] = signs[:, 0] * self.half_length, signs[:, 1] * self.half_width
        return self.centre_ground + flat @ about_vertical(self.yaw).T

    @property
    def centre_ground(self) -> Float[np.ndarray, "3"]:
        """Centre of the surface [m]."""
        return np.array([self.centre[0], 0.0, self.centre[1]])

    def holds(self, points_ground: Float[np.ndarray, "*batch 3"]) -> Bool[np.ndarray, " *batch"]:
        """Whether points of the floor lie on it; NaN does not."""
        own = (points_ground - self.centre_ground) @ about_vertical(self.yaw)
        return (np.abs(own[..., 0]) <= self.half_length) & (np.abs(own[..., 2]) <= self.half_width)


@dataclass(frozen=True)
class MeasurementSettings:
    """How well the laboratory measures (standard deviations of white noise)."""

    marker_rate: float = 100.0  # [Hz]
    force_rate: float = 1000.0  # [Hz]
    marker_noise_m: float = 0.0002
    gaps_per_marker_minute: float = 2.0
    gap_length_s: float = 0.12  # mean
    force_noise_N: tuple[float, float, float] = (0.8, 1.5, 0.8)
    moment_noise_Nm: tuple[float, float, float] = (0.35, 0.15, 0.35)  # about the plate's centre
    threshold_N: float = 12.0  # vertical force below which the plate's software sees no load
    zeroed: bool = (
        True  # whether it writes zeros then; otherwise the noise stays, without a centre of pressure
    )
    skin: bool = True  # whether soft tissue moves the markers
    force_delay_s: float = 0.0  # of the plates against the cameras: recorded(t) = true(t − delay); up to 0.2


def plates_under(
    contacts: ContactPlan,
    span: tuple[float, float],
    *,
    missed: Sequence[int] = (),
    size: tuple[float, float] = (0.60, 0.40),
    yaw: float = 0.0,
) -> tuple[Plate, ...]:
    """A plate under each step of a trial but the missed ones, in the order of the steps.

    Args:
        contacts: of the trial.
        span: first and last time of the recording [s].
        missed: which of the stances within the span (counted from 0) find no plate.
        size: length along the progression, and width [m].
        yaw: of the plates, so of the progression [rad].
    """
    inside = stances_within(contacts, span)
    middle = np.array([(contacts.sole.heel + contacts.sole.toe_tip) / 2, 0.0, 0.0])
    plates = []
    for k, stance in enumerate(inside):
        if k not in missed:
            x, _, z = stance.to_ground(middle)
            plates.append(Plate((float(x), float(z)), size[0] / 2, size[1] / 2, yaw))
    return tuple(plates)


def stances_within(contacts: ContactPlan, span: tuple[float, float]) -> list[Stance]:
    """Stances that reach into a span of time [s] by more than a hundredth of a second."""
    return [s for s in contacts.stances if min(s.end, span[1]) - max(s.start, span[0]) > 0.01]


def measure(
    trial: SyntheticTrial,
    plates: Sequence[Plate],
    marker_names: Sequence[str],
    settings: MeasurementSettings,
    rng: np.random.Generator,
) -> Capture:
    """Record a trial.

    Args:
        trial: what happened.
        plates: in the floor; a foot whose centre of pressure lies on one is measured by the first such.
        marker_names: which of the body's markers the person wears.
        settings: of the equipment.
        rng: of its noise.
    """
    marker_rng, force_rng = rng.spawn(2)
    markers = recorded_markers(trial, marker_names, settings, marker_rng)
    return Capture(trial.scenario.name, markers, _forces(trial, plates, settings, force_rng))


def standing_plates(contacts: ContactPlan, size: tuple[float, float] = (0.60, 0.40)) -> tuple[Plate, ...]:
    """Two plates that meet between the feet, one under each.

    Args:
        contacts: of both feet, right first.
        size: length to the front, and width [m].
    """
    middle = np.array([(contacts.sole.heel + contacts.sole.toe_tip) / 2, 0.0, 0.0])
    right, left = (stance.to_ground(middle) for stance in contacts.stances)
    sideways = (right - left) / np.linalg.norm(right - left)
    yaw = float(np.arctan2(sideways[0], sideways[2]))
    plates = []
    for side in (1, -1):
        x, _, z = (right + left) / 2 + side * (size[1] / 2 + 0.002) * sideways
        plates.append(Plate((float(x), float(z)), size[0] / 2, size[1] / 2, yaw))
    return tuple(plates)


def recorded_markers(
    trial: SyntheticTrial, names: Sequence[str], settings: MeasurementSettings, rng: np.random.Generator
) -> Markers:
    """What the cameras make of a trial, noise and gaps included."""
    motion = trial.frames(settings.marker_rate)
    body = trial.body
    if not settings.skin:
        body = type(body)(body.skeleton, body.sole, np.zeros_like(body.softness))
    columns = [body.skeleton.marker_names.index(name) for name in names]
    positions = body.markers(motion.q)[:, columns]
    positions += settings.marker_noise_m * rng.standard_normal(positions.shape)
    for m in range(len(names)):
        for _ in range(rng.poisson(settings.gaps_per_marker_minute * motion.frames / motion.rate / 60)):
            start = rng.integers(motion.frames)
            length = int(np.ceil(rng.exponential(settings.gap_length_s) * motion.rate))
            positions[start : start + length, m] = np.nan
    return Markers(tuple(names), positions, motion.rate)


def _forces(
    trial: SyntheticTrial, plates: Sequence[Plate], settings: MeasurementSettings, rng: np.random.Generator
) -> tuple[ForcePlate, ...]:
    samples = round(trial.scenario.duration * settings.force_rate) + 1
    times = np.arange(samples) / settings.force_rate
    reactions = trial.reactions(times - settings.force_delay_s)
    wrench = reactions.wrench_ground
    taken = np.zeros(wrench.shape[:2], dtype=bool)
    measured = []
    for k, plate in enumerate(plates):
        on = plate.holds(reactions.cop_ground) & ~taken
        taken |= on
        total = np.where(on[..., None], wrench, 0.0).sum(axis=1)
        measured.append(read_out(f"ground_force_{k + 1}", plate, total, settings, rng))
    return tuple(measured)


def read_out(
    name: str,
    plate: Plate,
    wrench: Float[np.ndarray, "samples 6"],
    settings: MeasurementSettings,
    rng: np.random.Generator,
) -> ForcePlate:
    """The plate's own channels with their noise, and what its software makes of them."""
    force = wrench[:, :3] + np.array(settings.force_noise_N) * rng.standard_normal((len(wrench), 3))
    about_centre = wrench[:, 3:] - cross(plate.centre_ground, wrench[:, :3])
    about_centre += np.array(settings.moment_noise_Nm) * rng.standard_normal((len(wrench), 3))
    loaded = force[:, 1] >= settings.threshold_N
    if settings.zeroed:
        force = np.where(loaded[:, None], force, 0.0)
        about_centre = np.where(loaded[:, None], about_centre, 0.0)
    vertical = np.where(loaded, force[:, 1], np.nan)
    cop = np.stack([about_centre[:, 2], 0 * vertical, -about_centre[:, 0]], axis=1) / vertical[:, None]
    return ForcePlate(
        name=name,
        force_ground=force,
        moment_ground=about_centre + cross(plate.centre_ground, force),
        cop_ground=cop + plate.centre_ground,
        rate=settings.force_rate,
        corners_ground=plate.corners_ground,
    )
