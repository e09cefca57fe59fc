"""What a solve gives back: one skeleton for the subject, and per trial the motion, torques and residuals."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Capture, Subject
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton


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
