"""One trial as plain arrays on the markers' clock, so that scene and plots know nothing of the solver.

Every array has one row a marker frame. Units are SI, the frame is the ground, y up; NaN means not measured.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.spatial.transform import Rotation

from addb_viewer.trial_view.joint_loads import JointLoads
from addb_viewer.trial_view.missing_force import LargestMissing, MissingForce
from addb_viewer.trial_view.palette import UNSEEN, error_colors
from annotations.suggested_activity import SuggestedActivity
from solver.common.notes import Note
from solver.contact.contact_phases import ContactPhase
from solver.contact.detected_ranges import Proposal
from solver.contact.detection_settings import DetectionSettings
from solver.contact.wrenches import NOBODY, FrameMask, MissingRange
from solver.dynamics.dynamics import TrialStd
from solver.kinematics.label_faults.fault import LabelFault


@dataclass(frozen=True)
class MarkerTracks:
    """Markers that are seen on some frame, in single precision, as the page takes them."""

    model: Float[np.ndarray, "frames markers 3"]  # [m] NaN where the model has no such marker
    seen: Bool[np.ndarray, "frames markers"]
    held: Float[np.ndarray, "frames markers 3"]  # [m] lost markers stay where they were
    colors: UInt8[np.ndarray, "frames markers 3"]

    @cached_property
    def came(self) -> Bool[np.ndarray, "frames markers"]:
        """Whether a marker was seen by then."""
        return np.maximum.accumulate(self.seen, axis=0)


def marker_tracks(
    measured: Float[np.ndarray, "frames markers 3"],
    model: Float[np.ndarray, "frames markers 3"],
    errors: Float[np.ndarray, "frames markers"],
) -> MarkerTracks:
    """Paths and colours of the markers.

    Args:
        measured: [m], NaN where unseen.
        model: [m], NaN where the model has no such marker.
        errors: distance between the two [m].
    """
    ever = np.isfinite(measured).all(axis=2).any(axis=0)
    shown = measured[:, ever]
    seen = np.isfinite(shown).all(axis=2)
    colors = error_colors(errors[:, ever])
    colors[~seen] = UNSEEN
    return MarkerTracks(model[:, ever].astype(np.float32), seen, held(shown, seen), colors)


def held(
    positions: Float[np.ndarray, "frames markers 3"], seen: Bool[np.ndarray, "frames markers"]
) -> Float[np.ndarray, "frames markers 3"]:
    """Lost markers stay where they were last seen, or, before that, where they will first be seen."""
    row = np.arange(len(positions))[:, None]
    last = np.maximum.accumulate(np.where(seen, row, -1), axis=0)
    source = np.where(last >= 0, last, seen.argmax(axis=0)[None, :])
    return np.take_along_axis(positions, source[:, :, None], axis=0).astype(np.float32)


@dataclass(frozen=True)
class MarkerReplay:
    """Measured markers, their labels repaired in a fit, and where the fitted skeleton has them."""

    names: tuple[str, ...]
    measured: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen
    model: Float[np.ndarray, "frames markers 3"]  # [m] NaN where the model has no such marker

    @property
    def errors(self) -> Float[np.ndarray, "frames markers"]:
        """Distance between the two [m]."""
        return np.linalg.norm(self.measured - self.model, axis=2)

    @cached_property
    def tracks(self) -> MarkerTracks:
        """Ready to be drawn."""
        return marker_tracks(self.measured, self.model, self.errors)


@dataclass(frozen=True)
class RequiredForce:
    """Of one foot; NaN on frames on which its force was measured and counts."""

    foot: str
    force: Float[np.ndarray, "frames 3"]  # [N]
    point: Float[np.ndarray, "frames 3"]  # [m] on the floor


@dataclass(frozen=True)
class PlateReplay:
    """One force plate."""

    name: str
    force: Float[np.ndarray, "frames 3"]  # [N] on the person; NaN outside the recording
    cop: Float[np.ndarray, "frames 3"]  # [m] NaN while unloaded
    foot: Int[np.ndarray, " frames"]  # index into `Replay.feet`; -1 where no foot was assigned
    corners: Float[np.ndarray, "4 3"] | None = None  # [m]


@dataclass(frozen=True)
class JointCentre:
    """Of the joint that a body hangs from."""

    name: str  # the model's
    center_body: Float[np.ndarray, "3"]  # [m]


@dataclass(frozen=True)
class BodyReplay:
    """Where the bodies are."""

    names: tuple[str, ...]
    wxyz: Float[np.ndarray, "frames bodies 4"]  # quaternion ground from body
    position: Float[np.ndarray, "frames bodies 3"]  # [m]
    root: int = 0  # index of the body that the camera follows
    forward: Float[np.ndarray, "frames 3"] | None = None  # unit; where the root body faces
    com_body: Float[np.ndarray, "bodies 3"] | None = None  # [m] centres of mass; None: the bodies' origins
    joints: Mapping[int, JointCentre] = field(default_factory=dict)  # by the body's index; the root has none

    @cached_property
    def known(self) -> Bool[np.ndarray, "frames bodies"]:
        """Where a body has a pose."""
        return np.asarray(np.isfinite(self.position).all(axis=2) & np.isfinite(self.wxyz).all(axis=2))

    @property
    def comings_and_goings(self) -> list[int]:
        """The first frame and each on which some body comes into view or leaves."""
        return np.flatnonzero(np.r_[True, (self.known[1:] != self.known[:-1]).any(axis=1)]).tolist()

    def point_ground(
        self, index: int, point_body: Float[np.ndarray, "3"] | None = None
    ) -> Float[np.ndarray, "frames 3"]:
        """Path of a point of a body [m], its centre of mass unless told otherwise; NaN outside the fit."""
        if point_body is None:
            point_body = np.zeros(3) if self.com_body is None else self.com_body[index]
        path = self.position[:, index].copy()
        known = np.isfinite(path).all(axis=1) & np.isfinite(self.wxyz[:, index]).all(axis=1)
        path[known] += Rotation.from_quat(self.wxyz[known, index][:, [1, 2, 3, 0]]).apply(point_body)
        return path


@dataclass(frozen=True)
class ResidualReplay:
    """What F = ma still lacks: required external wrench less the measured one."""

    force: Float[np.ndarray, "frames 3"]  # [N]
    moment: Float[np.ndarray, "frames 3"]  # [N·m] about the root joint's centre
    com: Float[np.ndarray, "frames 3"]  # [m]
    used: Bool[np.ndarray, " frames"]  # frames that the figures count
    force_limit: float  # [N] of Hicks et al. 2015
    moment_limit: float  # [N·m] likewise
    counted: Float[np.ndarray, "frames 3"] | None = None  # [N] sum of the measured forces that count

    @property
    def required(self) -> Float[np.ndarray, "frames 3"] | None:
        """What the motion demands from outside in all [N]."""
        return None if self.counted is None else self.counted + self.force


@dataclass(frozen=True)
class JointReplay:
    """Generalized coordinates, the torques that move them, and what these deliver."""

    names: tuple[str, ...]
    rotates: tuple[bool, ...]  # True: an angle and a torque; False: a displacement and a force
    position: Float[np.ndarray, "frames dofs"]  # [rad or m] of the motion that torques were computed on
    torque: Float[np.ndarray, "frames dofs"] | None = None  # [N·m or N]
    predicted: bool = False  # the torques rest on no measured force at all
    speed: Float[np.ndarray, "frames dofs"] | None = None  # [rad/s or m/s]
    power: Float[np.ndarray, "frames dofs"] | None = None  # [W] positive where the joint delivers work
    limits: tuple[tuple[float, float], ...] = ()  # [rad or m] of each coordinate; empty: not known
    of_root: frozenset[str] = frozenset()  # coordinates whose torque is the residual
    mass_kg: float | None = None  # of the person; None: not known
    std: TrialStd | None = None  # how far all these may be off; None: of nothing known


@dataclass(frozen=True)
class ForceUse:
    """Which forces the fit used, and what detection thinks of them. Frames are the recording's."""

    contacts: tuple[ContactPhase, ...] = ()
    missing: tuple[MissingRange, ...] = ()  # left out, and why
    source: str = NOBODY  # who decided about the trial, as in `FrameMask`
    proposals: tuple[Proposal, ...] = ()
    sources: tuple[str, ...] = ()  # who left each of `missing` out; empty: not known
    counts: Bool[np.ndarray, "frames feet"] | None = None  # the fit's mask; None: the trial has no forces
    confidence: float = DetectionSettings.confidence  # from which on a proposal is left out

    @classmethod
    def of(
        cls,
        mask: FrameMask | None,
        proposals: tuple[Proposal, ...],
        confidence: float,
        contacts: tuple[ContactPhase, ...] = (),
    ) -> "ForceUse":
        """What a mask says; None: the trial has no forces."""
        if mask is None:
            return cls(contacts, proposals=proposals, confidence=confidence)
        return cls(contacts, mask.reasons, mask.source, proposals, mask.sources, mask.counts, confidence)

    def source_of(self, k: int) -> str:
        """Who left the k-th of `missing` out."""
        return self.sources[k] if self.sources else self.source


@dataclass(frozen=True)
class Replay:
    """A trial, ready to be drawn."""

    name: str
    times: Float[np.ndarray, " frames"]  # [s] on the recording's clock
    rate: float  # [Hz]
    markers: MarkerReplay
    plates: tuple[PlateReplay, ...] = ()
    feet: tuple[str, ...] = ()
    bodies: BodyReplay | None = None
    residual: ResidualReplay | None = None
    joints: JointReplay | None = None
    joint_loads: JointLoads | None = None
    required: tuple[RequiredForce, ...] = ()  # of feet whose force is missing
    missing: MissingForce | None = None
    forces: ForceUse = field(default_factory=ForceUse)
    label_faults: tuple[LabelFault, ...] = ()  # repaired in the measured markers
    suggested: tuple[SuggestedActivity, ...] = ()  # what the person seems to do; nobody has said so
    notes: tuple[Note, ...] = ()

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.times)

    @cached_property
    def in_view(self) -> Bool[np.ndarray, " frames"]:
        """Frames on which the person is seen: those of a fit with a pose, else with a marker."""
        if self.bodies is None:
            return np.asarray(np.isfinite(self.markers.measured).all(axis=2).any(axis=1))
        return np.asarray(np.isfinite(self.bodies.position).any(axis=(1, 2)))

    @property
    def first_in_view(self) -> int:
        """The first of these frames; 0 where there is none."""
        return int(self.in_view.argmax())

    def most_missing(self, start: int, end: int, foot: str | None) -> LargestMissing | None:
        """Where most of a foot's force is missing of frames start to end − 1; None where nobody knows.

        Args:
            start: first frame.
            end: the first frame after the range.
            foot: its body; None: all feet together.
        """
        if self.missing is None or foot not in (None, *self.feet):
            return None
        return self.missing.largest(start, end, None if foot is None else self.feet.index(foot))


@dataclass(frozen=True)
class BodySize:
    """What residual limits are measured in."""

    mass_kg: float
    height_m: float
