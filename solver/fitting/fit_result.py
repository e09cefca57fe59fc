"""What a solve gives back: one skeleton for the subject, and per trial the motion, torques and residuals."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Capture, Subject, UnreadTrial, UnusedFile
from solver.common.notes import Note
from solver.contact.detected_ranges import Proposal
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.com_trajectory import Standing
from solver.dynamics.cross_validation.held_out import HeldOut, HeldOutLayout
from solver.dynamics.dynamics import Dynamics, MassStd, TrialStd
from solver.dynamics.force_prediction.learnt_terms import LearntTerms
from solver.kinematics.label_faults.fault import LabelFault
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class KinematicsOnly:
    """What the markers alone said, before the trajectory was fitted to the forces as well."""

    motion: Motion
    marker_errors: MarkerErrors


@dataclass(frozen=True)
class TrialFit:
    """One solved trial."""

    capture: Capture  # its labels repaired
    motion: Motion
    marker_errors: MarkerErrors
    model_markers_ground: Float[np.ndarray, "frames markers 3"]  # [m] in the order of marker_errors.names
    contacts: ContactWrenches | None = None
    mask: FrameMask | None = None
    proposals: tuple[Proposal, ...] = ()  # what detection thinks of the forces, sure or not
    dynamics: Dynamics | None = None
    kinematics_only: KinematicsOnly | None = None  # None: the motion is that of the markers alone
    held_out: HeldOut | None = None
    spline: Float[np.ndarray, "coefficients dofs"] | None = None  # of a motion that was fitted to forces
    prediction_spline: Float[np.ndarray, "coefficients dofs"] | None = (
        None  # of the fit that predicted forces
    )
    costs: tuple[float, ...] = ()  # of the trajectory fit of all trials: at first, after each iteration
    seconds: dict[str, float] = field(default_factory=dict)  # CPU seconds: load, kinematics, dynamics
    notes: tuple[Note, ...] = ()
    label_faults: tuple[LabelFault, ...] = ()  # that were repaired in the capture, in the order of time
    left_open: Bool[np.ndarray, "frames dofs"] | None = None  # coordinates that the markers seen leave open
    unseen_coordinates: tuple[str, ...] = ()  # of joints beyond which no marker is ever seen
    why_not_predicted: str = ""  # where the motion cannot tell ground forces
    std: TrialStd | None = None  # None: the motion is that of the markers alone, or an older version's fit

    @property
    def forces_known(self) -> Bool[np.ndarray, " frames"]:
        """Frames on which every foot's force was measured and counts: the complement of the paper's U."""
        if self.contacts is None or self.mask is None:
            return np.zeros(self.motion.frames, dtype=bool)
        return self.contacts.observed & self.mask.all_feet

    @property
    def forces_predicted(self) -> bool:
        """Whether no force counts anywhere, so that torques rest on the motion alone."""
        return self.dynamics is not None and self.mask is not None and not self.mask.counts.any()


@dataclass(frozen=True)
class SettledFit:
    """What the trajectory fit found beside the motions: a re-solve near an edit leaves it as it is."""

    mass_kg: float  # of the skeleton that the fit began with
    gains: Mapping[str, float]  # by trial, that its forces were divided by
    asked_phi: Float[np.ndarray, " parameters"]  # inertias that the forces would like better
    prediction_notes: tuple[Note, ...]  # on what the fit that predicted forces learnt
    known: Mapping[str, tuple[tuple[int, int], ...]]  # by trial, stretches of known forces
    known_to_all: Mapping[str, tuple[tuple[int, int], ...]]  # likewise, at the last fit of all frames
    mass_to_all_kg: float | None = None  # likewise, the mass; None: `mass_kg`
    mass_std: MassStd | None = None  # None: inertias were not fitted, or by an older version


@dataclass(frozen=True)
class Groundwork:
    """What a solve finds that no review changes, and where the search ended: a re-solve begins here."""

    skeleton: Skeleton  # scaled, with fitted marker offsets; its mass is still the model's
    match: MarkerMatch
    notes: tuple[Note, ...]  # of matching and scaling
    unread: tuple[UnreadTrial, ...] = ()  # that the solve went without
    standing: tuple[Standing, ...] = ()  # what plates read under a person whose mass nobody entered
    mass_kg: float | None = None  # that forces were judged with
    phi: Float[np.ndarray, " parameters"] | None = (
        None  # fitted inertias; None: no trial was fitted to forces
    )
    learnt: LearntTerms | None = None  # by the last prediction fit fit; None: there was none
    learnt_on: Mapping[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    # by trial, the stretches of known frames that chose the kinds of these terms
    settled: SettledFit | None = None  # None: no trial was fitted to forces
    prediction_kinds: tuple[str, ...] | None = None  # that predicted held-out blocks; None: not asked yet


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
    notes: tuple[Note, ...] = ()
    groundwork: Groundwork | None = None
    held_out_due: bool = False  # it is still to be judged on held-out forces, for these reviews
    held_out_layouts: tuple[HeldOutLayout, ...] = ()  # that it was judged on

    @property
    def unread(self) -> tuple[UnreadTrial, ...]:
        """Trials that were wanted and could not be read."""
        return self.groundwork.unread if self.groundwork else ()

    @property
    def mass_std(self) -> MassStd | None:
        """How far the masses may be off; None where no force told them."""
        settled = self.groundwork.settled if self.groundwork else None
        return settled.mass_std if settled else None

    @property
    def unused(self) -> tuple[UnusedFile, ...]:
        """Every file of the folder that went into nothing here; those that cannot be read first."""
        return (*(trial.file for trial in self.unread), *self.subject.unused)


@dataclass(frozen=True)
class StanceInfluence:
    """What torques would change elsewhere if the forces of one stance had not been seen."""

    trial: str
    foot: str
    frames: tuple[int, int]  # of the trial: the first, and the first one after the stance
    torque_change: Float[np.ndarray, "frames dofs"]  # [N·m or N]; NaN on the stance and where nothing is told
    dof: str  # whose torque changes most in terms of its standard deviation, the root's left out
    at_frame: int  # where it does
    change: float  # of that torque [N·m or N]
    std: float  # of that torque [N·m or N]
