"""The frames of a trial: what was measured, and of each pass its motion, contact forces and what follows.

Coordinates and joints stand in the order in which readers of B3D take them from its model: from the root
down, children in the order of the model file. Locked coordinates are degrees of freedom that stand still;
coupled ones, and joints with no others (the patellae), are not among them.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.formats.b3d.b3d_fields import PassFrames, PassHeader, SensorFrames, TrialHeader, TrialType
from solver.capture.formats.b3d.frames import present
from solver.capture.plates.conditioning import fill_gaps, resample_plate
from solver.capture.plates.force_settings import ConditioningSettings
from solver.common.frames_at_once import spans
from solver.dynamics.root_wrench import centre_of_mass, root_wrench
from solver.kinematics.motion import Motion, ResampledMotion
from solver.kinematics.root_joint import RootJoint, root_joint
from solver.skeleton.forward import ForwardKinematics, Poses, cross
from solver.skeleton.osim_writer import coordinate_names, joint_order
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

HISTORY_ENTRIES = 10  # the present frame and nine earlier ones: what models of the dataset are fed with
HISTORY_STRIDE = 3  # frames from one to the next; likewise
AT_ONCE = 2048  # frames of a long motion; each takes 20 kB on the way
REMEMBERED = (HISTORY_ENTRIES - 1) * HISTORY_STRIDE  # earlier frames that a frame tells of
SMALLEST_VERTICAL_N = 1e-3  # below it a force has no point where it meets the ground


def unlocked(skeleton: Skeleton) -> Skeleton:
    """The skeleton with its locked coordinates among the degrees of freedom."""
    free = tuple(replace(c, locked=False) for c in skeleton.coordinates)
    return replace(skeleton, coordinates=free)


def unlocked_motion(motion: Motion, skeleton: Skeleton) -> Motion:
    """The motion of `unlocked(skeleton)`: locked coordinates stay at their values."""
    free = unlocked(skeleton).free_coordinates

    def widened(values: np.ndarray, of_locked: list[float]) -> np.ndarray:
        return np.column_stack(
            [
                values[:, motion.dofs.index(c.name)] if c.name in motion.dofs else np.full(len(values), still)
                for c, still in zip(free, of_locked, strict=True)
            ]
        )

    moved = replace(motion, dofs=unlocked(skeleton).dofs, q=widened(motion.q, [c.default for c in free]))
    if isinstance(moved, ResampledMotion):
        rest = [0.0] * len(free)
        return replace(moved, qd=widened(moved.qd, rest), qdd=widened(moved.qdd, rest))
    return moved


def joints_in_order(skeleton: Skeleton) -> list[int]:
    """Indices of the joints, from the root down."""
    rank = {joint: place for place, joint in enumerate(joint_order(skeleton))}
    children: dict[int, list[int]] = {}
    for joint in sorted(rank, key=rank.__getitem__):
        children.setdefault(skeleton.joints[joint].parent, []).append(joint)
    order: list[int] = []
    waiting = list(children.get(-1, ()))
    while waiting:
        joint = waiting.pop()
        order.append(joint)
        waiting += children.get(joint, [])[::-1]
    return [joint for joint in order if not _only_coupled(skeleton, joint)]


def dofs_in_order(skeleton: Skeleton) -> tuple[str, ...]:
    """Names of the coordinates that make up `pos`, locked ones included."""
    free = set(unlocked(skeleton).dofs)
    names = (name for i in joints_in_order(skeleton) for name in coordinate_names(skeleton.joints[i]))
    return tuple(dict.fromkeys(name for name in names if name in free))


def _only_coupled(skeleton: Skeleton, joint: int) -> bool:
    coupled = {c.name for c in skeleton.coordinates if c.coupling is not None}
    names = coordinate_names(skeleton.joints[joint])
    return bool(names) and coupled.issuperset(names)


class SeriesOnDisk:
    """Numbers by frames, in the order in which they were added; read as slices, or all as an array."""

    def __init__(self, folder: Path, width: int) -> None:
        """Without frames.

        Args:
            folder: where the file is, on a disk; it is gone with the series, however the program ends.
            width: numbers a frame.
        """
        self._file = TemporaryFile(dir=folder)  # noqa: SIM115 (as long as the series)
        self._frames, self._width = 0, width

    def add(self, values: Float[np.ndarray, "frames width"]) -> None:
        """Further frames."""
        self._file.seek(0, 2)
        self._file.write(np.ascontiguousarray(values, float).data)
        self._frames += len(values)

    @property
    def shape(self) -> tuple[int, int]:
        """Frames, and numbers a frame."""
        return self._frames, self._width

    def __len__(self) -> int:
        return self._frames

    def __getitem__(self, frames: slice) -> Float[np.ndarray, "frames width"]:
        start, stop, _ = frames.indices(self._frames)
        values = np.empty((max(0, stop - start), self._width))
        self._file.seek(start * self._width * values.itemsize)
        self._file.readinto(values.data)
        return values

    def __array__(self, dtype: np.dtype | None = None, copy: bool | None = None) -> np.ndarray:
        return self[:] if dtype is None else self[:].astype(dtype, copy=False)


def on_disk(values: Float[np.ndarray, "frames width"], folder: Path) -> Any:
    """The same series, to be read like an array."""
    series = SeriesOnDisk(folder, values.shape[1])
    series.add(values)
    return series


@dataclass(frozen=True)
class RootFrame:
    """The root body's pose over time."""

    R_ground_root: Float[np.ndarray, "frames 3 3"]
    p_ground_root: Float[np.ndarray, "frames 3"]  # [m]

    def vectors(self, ground: Float[np.ndarray, "frames *n 3"]) -> Float[np.ndarray, "frames *n 3"]:
        """Directions: the root's velocity and place don't enter."""
        return np.einsum("tji,t...j->t...i", self.R_ground_root, ground)

    def points(self, ground: Float[np.ndarray, "frames *n 3"]) -> Float[np.ndarray, "frames *n 3"]:
        """Places [m]."""
        between = (slice(None), *(None,) * (ground.ndim - 2))
        return self.vectors(ground - self.p_ground_root[between])

    def wrench(
        self, moment_ground: Float[np.ndarray, "frames 3"], force_ground: Float[np.ndarray, "frames 3"]
    ) -> Float[np.ndarray, "frames 6"]:
        """[moment about the root's origin, force] from the moment about the ground origin [N·m, N]."""
        moment = moment_ground - cross(self.p_ground_root, force_ground)
        return np.hstack([self.vectors(moment), self.vectors(force_ground)])

    def history(self) -> tuple[Float[np.ndarray, "frames entries 3"], Float[np.ndarray, "frames entries 3"]]:
        """Where the root was: origin [m] and body-fixed XYZ angles [rad], in its present frame.

        The first entry is the present; entries from before the trial are zero.
        """
        frames = len(self.p_ground_root)
        places, angles = np.zeros((2, frames, HISTORY_ENTRIES, 3))
        for entry in range(HISTORY_ENTRIES):
            now = np.arange(entry * HISTORY_STRIDE, frames)
            if not len(now):
                break
            then = now - entry * HISTORY_STRIDE
            back = self.R_ground_root[now].transpose(0, 2, 1)
            offset = self.p_ground_root[then] - self.p_ground_root[now]
            places[now, entry] = (back @ offset[..., None])[..., 0]
            turned = back @ self.R_ground_root[then]
            known = np.isfinite(turned).all(axis=(1, 2))
            angles[now, entry] = np.nan
            angles[now[known], entry] = Rotation.from_matrix(turned[known]).as_euler("XYZ")
        return places, angles


@dataclass(frozen=True)
class ContactForces:
    """What acts on the contact bodies, in the ground frame; zero where it does not count."""

    bodies: Sequence[str]
    force: Float[np.ndarray, "frames bodies 3"]  # [N]
    moment: Float[np.ndarray, "frames bodies 3"]  # [N·m] about the ground origin
    height: Float[np.ndarray, "frames bodies"]  # [m] of the surface; NaN while the body is unloaded

    @classmethod
    def on(
        cls,
        bodies: Sequence[str],
        own: Sequence[str],
        wrench: Float[np.ndarray, "frames own 6"],
        height: Float[np.ndarray, "frames own"],
    ) -> "ContactForces":
        """Forces on some of the bodies, none on the others.

        Args:
            bodies: all of the file.
            own: those with forces.
            wrench: force [N] and moment about the ground origin [N·m].
            height: of their centres of pressure [m].
        """
        force, moment = np.zeros((2, len(wrench), len(bodies), 3))
        heights = np.full((len(wrench), len(bodies)), np.nan)
        columns = [bodies.index(body) for body in own]
        force[:, columns], moment[:, columns], heights[:, columns] = wrench[..., :3], wrench[..., 3:], height
        return cls(bodies, force, moment, heights)

    def at(self, frames: slice) -> "ContactForces":
        """Those of some frames."""
        return ContactForces(self.bodies, self.force[frames], self.moment[frames], self.height[frames])


@dataclass(frozen=True)
class _State:
    """Some frames of a motion, with the derivatives of the whole."""

    dofs: tuple[str, ...]
    q: Float[np.ndarray, "frames dofs"]
    velocity: Float[np.ndarray, "frames dofs"]
    acceleration: Float[np.ndarray, "frames dofs"]

    def at(self, frames: slice) -> "_State":
        return _State(self.dofs, self.q[frames], self.velocity[frames], self.acceleration[frames])


def pass_frames(
    skeleton: Skeleton, motion: Motion, contact: ContactForces, scratch: Path | None = None
) -> PassFrames:
    """Everything that the format asks of a pass.

    Args:
        skeleton: scaled, with the subject's mass.
        motion: of its degrees of freedom.
        contact: at the motion's frames.
        scratch: folder on a disk; there, not in memory, is what a long motion's frames hold. None: in memory.

    Raises:
        ModelError: the skeleton's root is not free to move in all six ways.
    """
    free = unlocked_motion(motion, skeleton).without_derivatives()
    whole = _State(free.dofs, free.q, free.velocity, free.acceleration)
    del free
    if len(spans(motion.frames)) == 1:
        return _frames(skeleton, whole, contact)
    parts = (_piece(skeleton, whole, contact, piece) for piece in spans(motion.frames, AT_ONCE))
    return _gathered(parts, motion.frames, scratch)


def _piece(skeleton: Skeleton, whole: _State, contact: ContactForces, piece: slice) -> dict[str, np.ndarray]:
    """Series of some frames, by name; they may tell of earlier ones."""
    first = max(0, piece.start - REMEMBERED)
    some = slice(first, piece.stop)
    series = present(_frames(skeleton, whole.at(some), contact.at(some)))
    return {name: values[piece.start - first :] for name, values in series.items()}


def _gathered(parts: Iterable[dict[str, np.ndarray]], frames: int, scratch: Path | None) -> PassFrames:
    series: dict[str, Any] = {}
    done = 0
    for part in parts:
        for name, values in part.items():
            if name not in series:
                width = values.shape[1]
                series[name] = SeriesOnDisk(scratch, width) if scratch else np.empty((frames, width))
            if scratch:
                series[name].add(values)
            else:
                series[name][done : done + len(values)] = values
        done += len(part["pos"])
    return PassFrames(**series)


def _frames(skeleton: Skeleton, state: _State, contact: ContactForces) -> PassFrames:
    moved = _Moved(skeleton, state)
    columns = [moved.motion.dofs.index(name) for name in dofs_in_order(skeleton)]
    tau = moved.torques(contact)
    frame = moved.root_frame
    residual_ground = root_wrench(moved.root, moved.kinematics.chain, moved.poses, tau)
    point, torque = central_axis(contact)
    com_acceleration = moved.com_acceleration() - moved.skeleton.gravity
    centres = moved.joint_centres(joints_in_order(skeleton))
    twist, twist_rate = moved.root_twists()
    places, angles = frame.history()
    return PassFrames(
        pos=moved.motion.q[:, columns],
        vel=moved.motion.velocity[:, columns],
        acc=moved.motion.acceleration[:, columns],
        tau=tau[:, columns],
        ground_contact_wrench=_flat(np.concatenate([contact.moment, contact.force], axis=2)),
        ground_contact_center_of_pressure=_flat(point),
        ground_contact_torque=_flat(torque),
        ground_contact_force=_flat(contact.force),
        com_pos=centre_of_mass(moved.skeleton, moved.poses),
        com_vel=moved.com_velocity(),
        com_acc=com_acceleration,
        root_frame_residual=frame.wrench(residual_ground[:, 3:], residual_ground[:, :3]),
        root_frame_ground_contact_wrench=np.hstack(
            [frame.wrench(contact.moment[:, b], contact.force[:, b]) for b in range(len(contact.bodies))]
        ),
        root_frame_joint_centers=_flat(frame.points(centres)),
        world_frame_joint_centers=_flat(centres),
        root_frame_com_acc=frame.vectors(com_acceleration),
        root_frame_ground_contact_center_of_pressure=_flat(frame.points(point)),
        root_frame_ground_contact_torques=_flat(frame.vectors(torque)),
        root_frame_ground_contact_force=_flat(frame.vectors(contact.force)),
        root_frame_spatial_velocity=twist,
        root_frame_spatial_acceleration=twist_rate,
        root_frame_root_pos_history=_flat(places),
        root_frame_root_euler_history=_flat(angles),
    )


def central_axis(
    contact: ContactForces,
) -> tuple[Float[np.ndarray, "frames bodies 3"], Float[np.ndarray, "frames bodies 3"]]:
    """Where the wrench's central axis meets the surface [m], and the torque that is left there [N·m].

    That torque is parallel to the force, which a free moment about the vertical is not; the two points are
    some millimetres apart. While a body is unloaded, its point is the ground origin.
    """
    force, moment = contact.force, contact.moment
    loaded = np.isfinite(contact.height) & (np.abs(force[..., 1]) > SMALLEST_VERTICAL_N)
    square = np.where(loaded, (force**2).sum(axis=-1), 1.0)
    nearest = cross(force, moment) / square[..., None]  # the axis' point nearest to the ground origin
    along = (contact.height - nearest[..., 1]) / np.where(loaded, force[..., 1], 1.0)
    point = np.where(loaded[..., None], nearest + along[..., None] * force, 0.0)
    return point, moment - cross(point, force)


class _Moved:
    """A skeleton in motion, locked coordinates among its degrees of freedom."""

    def __init__(self, skeleton: Skeleton, motion: _State) -> None:
        self.skeleton = unlocked(skeleton)
        self.motion = motion
        self.kinematics = ForwardKinematics(self.skeleton)
        self.dynamics = RigidBodyModel(self.skeleton)
        self.poses: Poses = self.kinematics.poses(self.motion.q)
        self.root: RootJoint = root_joint(self.skeleton)
        self.root_frame = RootFrame(
            self.poses.R_ground_body[:, self.root.body], self.poses.p_ground_body[:, self.root.body]
        )

    @property
    def _state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.motion.q, self.motion.velocity, self.motion.acceleration

    def torques(self, contact: ContactForces) -> Float[np.ndarray, "frames dofs"]:
        """Generalized forces that the motion demands beyond the contact forces."""
        wrenches = np.concatenate([contact.force, contact.moment], axis=2)
        bodies = [self.skeleton.body_index(name) for name in contact.bodies]
        return self.dynamics.inverse_dynamics(*self._state, wrenches, bodies)

    def com_acceleration(self) -> Float[np.ndarray, "frames 3"]:
        return self.dynamics.centre_of_mass_acceleration(*self._state)

    def com_velocity(self) -> Float[np.ndarray, "frames 3"]:
        """J q̇: each elementary joint moves the share of the mass that it carries."""
        share = np.array([body.mass for body in self.skeleton.bodies]) / self.skeleton.mass
        offsets = np.array([body.com_body for body in self.skeleton.bodies])
        centres = self.poses.p_ground_body + (self.poses.R_ground_body @ offsets[..., None])[..., 0]
        carried = self.kinematics.carries * share
        moment = np.einsum("pb,tbi->tpi", carried, centres)
        angular, linear = np.split(self.poses.twists(), 2, axis=2)
        columns = cross(angular, moment) + linear * carried.sum(axis=1)[:, None]
        return np.einsum("tpi,tp->ti", columns, self.motion.velocity[:, self.kinematics.chain.dof])

    def joint_centres(self, joints: Sequence[int]) -> Float[np.ndarray, "frames joints 3"]:
        """Origins of the joints' frames on their children [m]."""
        offsets = np.array([self.skeleton.joints[j].p_child_frame for j in joints])
        turned = (self.poses.R_ground_body[:, joints] @ offsets[..., None])[..., 0]
        return self.poses.p_ground_body[:, joints] + turned

    def root_twists(self) -> tuple[Float[np.ndarray, "frames 6"], Float[np.ndarray, "frames 6"]]:
        """S q̇, and S q̈ with the linear part less gravity: [angular, linear of the root's origin], root frame.

        S q̈ lacks Ṡ q̇ and so is no angular acceleration; but it is what the format's other writers put there.
        """
        own: Int[np.ndarray, " own"] = np.flatnonzero(self.kinematics.chain.body == self.root.body)
        driven_by = self.kinematics.chain.dof[own]
        columns = self.poses.twists()[:, own]
        frame = self.root_frame

        def seen(rates: Float[np.ndarray, "frames dofs"]) -> tuple[np.ndarray, np.ndarray]:
            angular, linear = np.split(np.einsum("tpk,tp->tk", columns, rates[:, driven_by]), 2, axis=1)
            return angular, linear + cross(angular, frame.p_ground_root)

        turning, moving = seen(self.motion.velocity)
        turning_rate, moving_rate = seen(self.motion.acceleration)
        return (
            np.hstack([frame.vectors(turning), frame.vectors(moving)]),
            np.hstack([frame.vectors(turning_rate), frame.vectors(moving_rate - self.skeleton.gravity)]),
        )


def _flat(values: Float[np.ndarray, "frames n k"]) -> Float[np.ndarray, "frames n*k"]:
    return values.reshape(len(values), -1)


def marker_names(captures: Sequence[Capture]) -> tuple[str, ...]:
    """Every marker of any trial, in the order in which they come up."""
    return tuple(dict.fromkeys(name for capture in captures for name in capture.markers.names))


def sensor_frames(
    capture: Capture, names: Sequence[str], plates: int, settings: ConditioningSettings
) -> SensorFrames:
    """Markers in the order of `names`, NaN where unseen; plates, and zeros up to as many as `plates`.

    Force and moment are resampled to the markers' frames, and turned to act on the person; nothing else is
    done to them. The moment is about the stored centre of pressure, or about the ground origin while there is
    none. NaN on frames that the recording doesn't cover.
    """
    frames = capture.markers.frames
    cop, torque, force = np.zeros((3, frames, plates, 3))
    for k, plate in enumerate(capture.plates):
        cop[:, k], torque[:, k], force[:, k] = _wrench_at_frames(plate, capture.markers.times, settings)
    return SensorFrames(
        marker_obs=_observed(capture.markers, names).reshape(frames, -1),
        raw_force_plate_cop=cop.reshape(frames, -1),
        raw_force_plate_torque=torque.reshape(frames, -1),
        raw_force_plate_force=force.reshape(frames, -1),
    )


def trial_header(capture: Capture, passes: Sequence[PassHeader] = ()) -> TrialHeader:
    """What the format says of a trial, all of whose forces count and which nobody has reviewed."""
    markers = capture.markers
    return TrialHeader(
        name=capture.name,
        missing_GRF_reason=np.zeros(markers.frames, dtype=np.int32),
        trial_length=markers.frames,
        trial_timestep=1 / markers.rate,
        processing_pass_header=tuple(passes),
        num_force_plates=len(capture.plates),
        force_plate_corners=_corners(capture),
        original_name=capture.name,
        original_end_frame=markers.frames,
        original_start_time=markers.start_time,
        original_end_time=markers.start_time + markers.frames / markers.rate,
        has_manual_GRF_annotation=np.zeros(markers.frames, dtype=bool),
        trial_type=TrialType.OTHER,  # nobody has said where it was
    )


def _corners(capture: Capture) -> Float[np.ndarray, " 12*plates"]:
    """Four corners a plate [m]; NaN for those of a plate whose place isn't known."""
    unknown = np.full((4, 3), np.nan)
    return np.array(
        [unknown if plate.corners_ground is None else plate.corners_ground for plate in capture.plates]
    ).reshape(-1)


def _observed(markers: Markers, names: Sequence[str]) -> Float[np.ndarray, "frames markers 3"]:
    observed = np.full((markers.frames, len(names), 3), np.nan)
    observed[:, [names.index(name) for name in markers.names]] = markers.positions_ground
    return observed


def _wrench_at_frames(
    plate: ForcePlate, times: Float[np.ndarray, " frames"], settings: ConditioningSettings
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
    """Centre of pressure [m], moment about it [N·m] and force [N]."""
    whole, _, _ = fill_gaps(plate, settings)
    at_frames, covered = resample_plate(whole, times)
    cop = np.nan_to_num(at_frames.cop_ground)
    torque = at_frames.moment_ground - cross(cop, at_frames.force_ground)
    outside = ~covered[:, None]
    return (
        np.where(outside, np.nan, cop),
        np.where(outside, np.nan, torque),
        np.where(outside, np.nan, at_frames.force_ground),
    )
