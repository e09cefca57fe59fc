"""One trial as effects see it: how the body moves, what the plates recorded, what the cameras saw."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import CubicSpline

from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import PlateLoads, observed_at, shared_cutoff, smooth_samples
from solver.capture.plates.force_settings import ConditioningSettings
from solver.capture.resampling import bridge_gaps, rate_of
from solver.common.filters import low_pass
from solver.common.notes import Note
from solver.contact.detected_ranges import Proposal
from solver.contact.settings import ContactSettings
from solver.contact.sole import Sole
from solver.contact.wrenches import ContactWrenches
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import cross
from solver.skeleton.skeleton import Skeleton

SLOW_HZ = 6.0  # slower than markers' noise, faster than a hand's push
EMPTY_S = 0.05  # shorter, it may be where a record begins or ends

Times = Float[np.ndarray, " frames"]  # [s]


@dataclass(frozen=True, eq=False)
class PlateScene:
    """One force plate of a trial.

    `wrench_ground` is force [N] and moment about the ground origin [N·m] at the markers' frames, after the
    filter that motion and forces share; NaN nowhere (zero where nothing was recorded).
    """

    target: str  # "plate_1", counted as the file counts
    plate: ForcePlate  # as recorded
    loads: PlateLoads  # at the plate's own rate
    wrench_ground: Float[np.ndarray, "frames 6"]
    loaded: Bool[np.ndarray, " frames"]
    centre_ground: Float[np.ndarray, "3"]  # [m] of the corners, else of the loaded centres of pressure
    times: Float[np.ndarray, " frames"]  # [s]
    conditioning: ConditioningSettings

    def at_frames(
        self, samples_ground: Float[np.ndarray, "samples *columns"]
    ) -> Float[np.ndarray, "frames *columns"]:
        """Other samples of this plate through the same filter, at the markers' frames."""
        return self.at_times(samples_ground, self.times)

    def at_times(
        self, samples_ground: Float[np.ndarray, "samples *columns"], times: Float[np.ndarray, " frames"]
    ) -> Float[np.ndarray, "frames *columns"]:
        """Likewise at other times [s] on the markers' clock; NaN where nothing was recorded.

        A spline through filtered samples is not smoothed by being read between them.
        """
        recorded = samples_ground is self.loads.wrench_ground
        spline = self._recorded if recorded else self._smooth(samples_ground)
        samples = (times - self.plate.start_time) * self.plate.rate
        values = spline(np.clip(samples, 0, len(samples_ground) - 1))
        values[~self.covers(times)] = np.nan
        return values

    @cached_property
    def _recorded(self) -> CubicSpline:
        """Through the filtered samples as recorded: kept, since a search over a clock reads them often."""
        return self._smooth(self.loads.wrench_ground)

    def _smooth(self, samples_ground: Float[np.ndarray, "samples *columns"]) -> CubicSpline:
        """By the number of the sample."""
        cutoff = shared_cutoff(rate_of(self.times), self.conditioning)
        smooth = smooth_samples(
            samples_ground, self.loads.recorded, self.plate.rate, cutoff, self.conditioning
        )
        return CubicSpline(np.arange(len(smooth)), smooth)

    @property
    def seen_empty(self) -> bool:
        """Whether it was recorded for a while with less on it than the threshold of a contact."""
        empty = (self.loads.recorded & ~self.loads.carrying).sum()
        return bool(empty > EMPTY_S * self.plate.rate)

    @cached_property
    def carrying_share(self) -> Float[np.ndarray, " frames"]:
        """Whether it counts as loaded, at the markers' frames: 1 while it does, less at the edges."""
        return np.nan_to_num(self.at_frames(self.loads.carrying.astype(float)))

    def covers(self, times: Float[np.ndarray, " frames"]) -> Bool[np.ndarray, " frames"]:
        """Whether something was recorded at these times [s] on the markers' clock."""
        return observed_at(times, self.plate, self.loads.recorded)


@dataclass(frozen=True, eq=False)
class MarkerScene:
    """What the cameras saw and where the fitted model has its markers; the model's markers in their order."""

    names: tuple[str, ...]
    body: Int[np.ndarray, " markers"]
    observed_ground: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen
    model_ground: Float[np.ndarray, "frames markers 3"]  # [m]


@dataclass(frozen=True, eq=False)
class Scene:
    """One trial: the motion that the markers alone tell, and everything measured beside it.

    Motion and whatever derives from it are low-passed, for signatures; only `required_ground` is of the
    motion as the markers tell it, noise and all.
    """

    name: str
    skeleton: Skeleton
    motion: Motion
    velocity: Float[np.ndarray, "frames dofs"]
    acceleration: Float[np.ndarray, "frames dofs"]
    R_ground_body: Float[np.ndarray, "frames bodies 3 3"]
    p_ground_body: Float[np.ndarray, "frames bodies 3"]  # [m]
    material: Float[np.ndarray, "frames bodies 3 4"]  # A with ẍ − g = A [x_body; 1] [m/s²]
    com_ground: Float[np.ndarray, "frames 3"]  # [m]
    required_ground: Float[np.ndarray, "frames 6"]  # [N], [N·m about the ground origin]
    plates: tuple[PlateScene, ...]
    markers: MarkerScene
    soles: tuple[Sole, ...]
    contacts: ContactWrenches
    proposals: tuple[Proposal, ...]
    counts: Bool[np.ndarray, " frames"]  # recorded, tracked and not flagged by a person
    contact_settings: ContactSettings  # of the solve
    trajectory_settings: TrajectorySettings  # likewise
    notes: tuple[Note, ...] = field(default=())
    size_against_own_model: float | None = None  # logarithm; None where the model is nobody's
    mass_was_entered: bool = True  # the person's mass was entered; otherwise it is what the forces carry
    scale_factor: float | None = (
        None  # a scale's reading, as in the trials, over what was entered; None: no scale
    )

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.motion.frames

    @property
    def rate(self) -> float:
        """Of the frames [Hz]."""
        return self.motion.rate

    @property
    def times(self) -> Float[np.ndarray, " frames"]:
        """Of the frames, from the trial's start [s]."""
        return np.arange(self.frames) / self.rate

    @cached_property
    def measured_ground(self) -> Float[np.ndarray, "frames 6"]:
        """Wrench of all plates together [N], [N·m about the ground origin]."""
        return np.sum([p.wrench_ground for p in self.plates], axis=0)

    @cached_property
    def required_at_com_ground(self) -> Float[np.ndarray, "frames 6"]:
        """The required force at the centre of mass, as a wrench [N], [N·m about the ground origin]."""
        return force_at(self.required_ground[:, :3], self.com_ground)

    def loaded_plate(self, target: str) -> PlateScene | None:
        """The plate of that name, if anything loads it."""
        return next((p for p in self.plates if p.target == target and p.loaded.any()), None)

    def carrying_plate(self, target: str) -> PlateScene | None:
        """Likewise, if any of its samples counts as loaded."""
        return next((p for p in self.plates if p.target == target and p.loads.carrying.any()), None)

    @cached_property
    def T_ground_body(self) -> Float[np.ndarray, "frames bodies 4 4"]:
        """Poses as homogeneous matrices."""
        T = np.zeros((*self.R_ground_body.shape[:2], 4, 4))
        T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = self.R_ground_body, self.p_ground_body, 1.0
        return T

    def retime(self, read_at: Callable[[Times], Times]) -> Float[np.ndarray, "frames 6"]:
        """Wrench of all plates read at other times than the frames' [N], [N·m].

        What was recorded at no such time stays as it is: a shift explains nothing by leaving the recording.

        Args:
            read_at: from the frames' times to those at which to read [s].
        """
        total = np.zeros((self.frames, 6))
        for plate in self.plates:
            total += plate.at_times(plate.loads.wrench_ground, read_at(plate.times))
        unrecorded = self.unrecorded(read_at)
        total[unrecorded] = self.measured_ground[unrecorded]
        return total

    def unrecorded(self, read_at: Callable[[Times], Times]) -> Bool[np.ndarray, " frames"]:
        """Frames of which some plate recorded nothing at the times at which they are to be read."""
        is_recorded = np.ones(self.frames, dtype=bool)
        for plate in self.plates:
            is_recorded &= plate.covers(read_at(plate.times))
        return ~is_recorded

    @cached_property
    def missing_ground(self) -> Float[np.ndarray, "frames 6"]:
        """What the motion demands beyond what was recorded, low-passed [N], [N·m about the ground origin].

        On frames that don't count a line from one neighbour that does to the other.
        """
        missing = self.required_ground - self.measured_ground
        if not self.counts.any():
            return np.zeros_like(missing)
        return low_pass(bridge_gaps(missing, self.counts), self.rate, SLOW_HZ)

    @property
    def weight_N(self) -> float:
        """Body weight of the model."""
        return self.skeleton.mass * float(np.linalg.norm(self.skeleton.gravity))

    def point_ground(self, body: int, point_body: Float[np.ndarray, "3"]) -> Float[np.ndarray, "frames 3"]:
        """Where a point of a body is [m]."""
        return self.p_ground_body[:, body] + self.R_ground_body[:, body] @ point_body

    def point_velocity_ground(
        self, body: int, point_body: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "frames 3"]:
        """Its velocity, from differences between frames [m/s]."""
        return np.gradient(self.point_ground(body, point_body), 1 / self.rate, axis=0)


def force_at(
    force_ground: Float[np.ndarray, "*batch 3"], point_ground: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 6"]:
    """The wrench about the ground origin of a force at a point [N], [N·m]."""
    return np.concatenate(
        [
            np.broadcast_to(force_ground, np.broadcast_shapes(force_ground.shape, point_ground.shape)),
            cross(point_ground, force_ground),
        ],
        axis=-1,
    )


def moments_aside(force_ground: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "frames 6 2"]:
    """What forces add to a wrench per metre that they act farther along x, and along z [N·m/m]."""
    columns = np.zeros((len(force_ground), 6, 2))
    for k, axis in enumerate(np.eye(3)[[0, 2]]):
        columns[:, 3:, k] = cross(axis, force_ground)
    return columns


def loaded_plates(scenes: Sequence[Scene]) -> list[str]:
    """Targets of the plates that bear a load in some trial, each once."""
    return list(dict.fromkeys(p.target for scene in scenes for p in scene.plates if p.loaded.any()))
