"""What a solve gives back: one skeleton for the subject, and per trial the motion, torques and residuals."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Capture, Subject
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class MarkerErrors:
    """Distance of each model marker from the raw measured one [m], NaN where unseen."""

    names: tuple[str, ...]  # markers that model and recording share
    distance: Float[np.ndarray, "frames markers"]  # [m]

    @property
    def rms(self) -> float:
        """Root mean square over all seen marker-frames [m]."""
        return float(np.sqrt(np.nanmean(self.distance**2)))

    @property
    def rms_per_frame(self) -> Float[np.ndarray, " frames"]:
        """Root mean square over the markers of each frame [m]; NaN on frames without any."""
        seen = np.isfinite(self.distance)
        squares = np.where(seen, self.distance, 0.0) ** 2
        with np.errstate(invalid="ignore"):
            return np.sqrt(squares.sum(axis=1) / seen.sum(axis=1))

    @property
    def rms_frame_mean(self) -> float:
        """Mean over frames of the per-frame RMS, as peers print it [m]."""
        return float(np.nanmean(self.rms_per_frame))

    @property
    def maximum(self) -> float:
        """Largest distance of all marker-frames [m]."""
        return float(np.nanmax(self.distance))


@dataclass(frozen=True)
class Dynamics:
    """Inverse dynamics of one trial.

    The residual is the external wrench that the motion demands less the measured one: force [N], and moment
    [N·m] about the root joint's centre, both in the ground frame. Zero means F = ma holds.
    """

    joint_torques: Float[np.ndarray, "frames dofs"]  # [N·m or N], root dofs included
    residual_root: Float[np.ndarray, "frames 6"]
    residual_raw_root: Float[np.ndarray, "frames 6"]  # likewise against unfiltered forces
    com_ground: Float[np.ndarray, "frames 3"]  # [m]
    root_ground: Float[np.ndarray, "frames 3"]  # [m] the root joint's centre
    used: Bool[np.ndarray, " frames"]  # frames that the figures count


@dataclass(frozen=True)
class TrialFit:
    """One solved trial."""

    capture: Capture
    motion: Motion
    marker_errors: MarkerErrors
    model_markers_ground: Float[np.ndarray, "frames markers 3"]  # [m] in the order of marker_errors.names
    contacts: ContactWrenches | None = None
    mask: FrameMask | None = None
    dynamics: Dynamics | None = None
    seconds: dict[str, float] = field(default_factory=dict)  # CPU seconds: load, kinematics, dynamics
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Fit:
    """A subject, solved."""

    subject: Subject
    skeleton: Skeleton  # scaled, with fitted marker offsets and the subject's mass
    trials: tuple[TrialFit, ...]
    mass_kg: float
    height_m: float
    settings: dict[str, object] = field(default_factory=dict)
    provenance: dict[str, str] = field(default_factory=dict)  # input hashes and versions
    notes: tuple[str, ...] = ()
