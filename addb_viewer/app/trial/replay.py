"""One trial as plain arrays on the markers' clock, so that scene and plots know nothing of the solver.

Every array has one row a marker frame. Units are SI, the frame is the ground, y up; NaN means not measured.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from addb_viewer.app.trial.demanded_forces import DemandedForce, demanded_forces
from addb_viewer.app.trial.marker_tracks import MarkerTracks, marker_tracks
from addb_viewer.suggested_activities import suggestions_of
from annotations.suggested_activity import SuggestedActivity
from solver.capture.capture import Capture, ForcePlate
from solver.contact.contact_phases import ContactPhase, contact_phases
from solver.contact.detection_settings import DetectionSettings
from solver.contact.proposals import Proposal
from solver.contact.wrenches import NOBODY, MissingRange
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.fit import TrialFit
from solver.kinematics.label_faults.fault import LabelFault
from solver.settings import Settings, from_dict
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton
from solver.summary import STANDARD_GRAVITY, Thresholds


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
class PlateReplay:
    """One force plate."""

    name: str
    force: Float[np.ndarray, "frames 3"]  # [N] on the person; NaN outside the recording
    cop: Float[np.ndarray, "frames 3"]  # [m] NaN while unloaded
    foot: Int[np.ndarray, " frames"]  # index into `Replay.feet`; -1 where no foot was assigned
    corners: Float[np.ndarray, "4 3"] | None = None  # [m]


@dataclass(frozen=True)
class BodyReplay:
    """Where the bodies are."""

    names: tuple[str, ...]
    wxyz: Float[np.ndarray, "frames bodies 4"]  # quaternion ground from body
    position: Float[np.ndarray, "frames bodies 3"]  # [m]
    root: int = 0  # index of the body that the camera follows
    forward: Float[np.ndarray, "frames 3"] | None = None  # unit; where the root body faces
    com_body: Float[np.ndarray, "bodies 3"] | None = None  # [m] centres of mass; None: the bodies' origins

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
    """What F = ma still lacks: demanded external wrench less the measured one."""

    force: Float[np.ndarray, "frames 3"]  # [N]
    moment: Float[np.ndarray, "frames 3"]  # [N·m] about the root joint's centre
    com: Float[np.ndarray, "frames 3"]  # [m]
    used: Bool[np.ndarray, " frames"]  # frames that the figures count
    force_limit: float  # [N] of Hicks et al. 2015
    moment_limit: float  # [N·m] likewise
    counted: Float[np.ndarray, "frames 3"] | None = None  # [N] sum of the measured forces that count

    @property
    def demanded(self) -> Float[np.ndarray, "frames 3"] | None:
        """What the motion demands from outside in all [N]."""
        return None if self.counted is None else self.counted + self.force


@dataclass(frozen=True)
class JointReplay:
    """Generalized coordinates and the torques that move them."""

    names: tuple[str, ...]
    rotates: tuple[bool, ...]  # True: an angle and a torque; False: a displacement and a force
    position: Float[np.ndarray, "frames dofs"]  # [rad or m]
    torque: Float[np.ndarray, "frames dofs"] | None = None  # [N·m or N]
    foretold: bool = False  # the torques rest on no measured force at all


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
    demanded: tuple[DemandedForce, ...] = ()  # of feet whose force is missing
    forces: ForceUse = field(default_factory=ForceUse)
    label_faults: tuple[LabelFault, ...] = ()  # repaired in the measured markers
    suggested: tuple[SuggestedActivity, ...] = ()  # what the person seems to do; nobody has said so
    notes: tuple[str, ...] = ()

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.times)


@dataclass(frozen=True)
class Person:
    """What residual limits are measured in."""

    mass_kg: float
    height_m: float


def unfitted_replay(capture: Capture) -> Replay:
    """A recording that nothing has been fitted to yet: markers and plates."""
    measured = capture.markers.positions_ground
    return Replay(
        name=capture.name,
        times=capture.markers.times,
        rate=capture.markers.rate,
        markers=MarkerReplay(capture.markers.names, measured, np.full_like(measured, np.nan)),
        plates=tuple(_plate(plate, capture.markers.times) for plate in capture.plates),
        notes=capture.notes,
    )


def fitted_replay(
    trial: TrialFit, skeleton: Skeleton, person: Person, settings: Mapping[str, object]
) -> Replay:
    """A fitted trial; frames of the recording outside the fit stay without a skeleton (NaN).

    Args:
        trial: fitted.
        skeleton: of the fit.
        person: whom residuals are measured against.
        settings: of the fit, as it keeps them.
    """
    bare = unfitted_replay(trial.capture)
    on_fit = _Clock(bare.times, trial.motion.start_time, trial.motion.rate, trial.motion.frames)
    feet: tuple[str, ...] = ()
    plates, notes = bare.plates, bare.notes
    if trial.contacts is not None:
        notes = (*notes, *trial.contacts.notes)
        feet = trial.contacts.foot_bodies
        plates = tuple(
            PlateReplay(p.name, p.force, p.cop, on_fit.integers(trial.contacts.plate[:, i]), p.corners)
            for i, p in enumerate(plates)
        )
    return Replay(
        name=bare.name,
        times=bare.times,
        rate=bare.rate,
        markers=MarkerReplay(bare.markers.names, bare.markers.measured, _model_markers(trial, bare, on_fit)),
        plates=plates,
        feet=feet,
        bodies=_bodies(trial, skeleton, on_fit),
        residual=_residual(trial, person, on_fit),
        joints=_joints(trial, skeleton, on_fit),
        demanded=demanded_forces(trial, skeleton, on_fit.floats),
        forces=_force_use(trial, skeleton, from_dict(settings)),
        label_faults=trial.label_faults,
        suggested=suggestions_of(trial, skeleton),
        notes=(*notes, *trial.notes),
    )


class _Clock:
    """Which row of the fit belongs to each frame of the recording."""

    def __init__(self, times: Float[np.ndarray, " frames"], start: float, rate: float, rows: int) -> None:
        nearest = np.rint((times - start) * rate).astype(int)
        self.inside = (nearest >= 0) & (nearest < rows)
        self.row = np.clip(nearest, 0, max(rows - 1, 0))

    def floats(self, values: Float[np.ndarray, "rows *rest"]) -> Float[np.ndarray, "frames *rest"]:
        taken = values[self.row].astype(float)
        taken[~self.inside] = np.nan
        return taken

    def integers(self, values: Int[np.ndarray, " rows"]) -> Int[np.ndarray, " frames"]:
        return np.where(self.inside, values[self.row], -1)


def _plate(plate: ForcePlate, times: Float[np.ndarray, " frames"]) -> PlateReplay:
    """The plate's sample nearest to each marker frame: raw, so that what is drawn was measured."""
    clock = _Clock(times, plate.start_time, plate.rate, plate.samples)
    force = clock.floats(plate.force_ground)
    cop = clock.floats(plate.cop_ground)
    return PlateReplay(plate.name, force, cop, np.full(len(times), -1), plate.corners_ground)


def _model_markers(trial: TrialFit, bare: Replay, on_fit: _Clock) -> Float[np.ndarray, "frames markers 3"]:
    model = np.full_like(bare.markers.measured, np.nan)
    column = {name: i for i, name in enumerate(bare.markers.names)}
    for i, name in enumerate(trial.marker_errors.names):
        if name in column:
            model[:, column[name]] = on_fit.floats(trial.model_markers_ground[:, i])
    return model


def _bodies(trial: TrialFit, skeleton: Skeleton, on_fit: _Clock) -> BodyReplay:
    R_ground_body, p_ground_body = body_poses(skeleton, trial.motion.q)
    xyzw = Rotation.from_matrix(R_ground_body.reshape(-1, 3, 3)).as_quat()
    wxyz = xyzw[:, [3, 0, 1, 2]].reshape(*R_ground_body.shape[:2], 4)
    root = next((i for i, joint in enumerate(skeleton.joints) if joint.parent < 0), 0)
    return BodyReplay(
        names=skeleton.body_names,
        wxyz=on_fit.floats(wxyz),
        position=on_fit.floats(p_ground_body),
        root=root,
        forward=on_fit.floats(R_ground_body[:, root, :, 0]),
        com_body=np.stack([body.com_body for body in skeleton.bodies]),
    )


def _residual(trial: TrialFit, person: Person, on_fit: _Clock) -> ResidualReplay | None:
    if trial.dynamics is None or (trial.contacts is not None and not trial.contacts.has_plates):
        return None  # without a plate nothing was measured that anything could be left of
    weight, limits = person.mass_kg * STANDARD_GRAVITY, Thresholds()
    residual = on_fit.floats(trial.dynamics.residual_root)
    counted = None
    if trial.contacts is not None and trial.mask is not None:
        wrenches = counted_wrenches(trial.contacts.wrench_ground, trial.mask)
        counted = on_fit.floats(wrenches[:, :, :3].sum(axis=1))
    return ResidualReplay(
        force=residual[:, :3],
        moment=residual[:, 3:],
        com=on_fit.floats(trial.dynamics.com_ground),
        used=on_fit.integers(trial.dynamics.used.astype(int)) == 1,
        force_limit=limits.linear_BW * weight,
        moment_limit=limits.angular_BWh * weight * person.height_m,
        counted=counted,
    )


def _joints(trial: TrialFit, skeleton: Skeleton, on_fit: _Clock) -> JointReplay:
    torque = None if trial.dynamics is None else on_fit.floats(trial.dynamics.joint_torques)
    rotates = tuple(coordinate.motion != "translation" for coordinate in skeleton.free_coordinates)
    return JointReplay(
        skeleton.dofs, rotates, on_fit.floats(trial.motion.q), torque, foretold=trial.forces_foretold
    )


def _force_use(trial: TrialFit, skeleton: Skeleton, settings: Settings) -> ForceUse:
    """The fit's frames are the markers': one clock."""
    confidence = settings.detection.confidence  # from which on a fit leaves a proposal out
    if trial.contacts is None or not trial.contacts.has_plates:
        return ForceUse(proposals=trial.proposals, confidence=confidence)
    R_ground_body, p_ground_body = body_poses(skeleton, trial.motion.q)
    phases = contact_phases(
        trial.contacts,
        R_ground_body,
        p_ground_body,
        skeleton=skeleton,
        rate=trial.motion.rate,
        settings=settings.contact,
    )
    mask = trial.mask
    if mask is None:
        return ForceUse(phases, proposals=trial.proposals, confidence=confidence)
    return ForceUse(phases, mask.reasons, mask.source, trial.proposals, mask.sources, mask.counts, confidence)
