"""A recording, or its fit, as a `Replay`."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from addb_viewer.jobs.suggested_activities import suggestions_of
from addb_viewer.trial_view.joint_loads import JointLoads, joint_loads, large_joint_load
from addb_viewer.trial_view.joint_quantities import Kind
from addb_viewer.trial_view.missing_force import MissingForce, missing_force_of, predicted_wrenches
from addb_viewer.trial_view.replay import (
    BodyReplay,
    BodySize,
    ForceUse,
    JointCentre,
    JointReplay,
    MarkerReplay,
    PlateReplay,
    Replay,
    RequiredForce,
    ResidualReplay,
)
from solver.capture.capture import Capture, ForcePlate
from solver.capture.plates.centre_of_pressure import centre_of_pressure, surface_of
from solver.capture.plates.conditioning import at_nearest_samples, contact_samples
from solver.capture.plates.force_settings import CONDITIONING, ConditioningSettings
from solver.capture.plates.zero_level import zeroed
from solver.common.gravity import GRAVITY
from solver.contact.contact_phases import contact_phases
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.dynamics.thresholds import Thresholds
from solver.fitting.fit_result import TrialFit
from solver.fitting.seen_part import in_view, without_guesses
from solver.fitting.settings import Settings, from_dict
from solver.gait.trial_gait import joint_power
from solver.skeleton.forward import body_poses
from solver.skeleton.rotations import quaternions
from solver.skeleton.skeleton import Skeleton


def unfitted_replay(capture: Capture, conditioning: ConditioningSettings = CONDITIONING) -> Replay:
    """A recording that nothing has been fitted to yet: markers and plates."""
    measured = capture.markers.positions_ground
    return Replay(
        name=capture.name,
        times=capture.markers.times,
        rate=capture.markers.rate,
        markers=MarkerReplay(capture.markers.names, measured, np.full_like(measured, np.nan)),
        plates=tuple(_plate(plate, capture.markers.times, conditioning) for plate in capture.plates),
        notes=capture.notes,
    )


def fitted_replay(
    trial: TrialFit,
    skeleton: Skeleton,
    person: BodySize,
    settings: Mapping[str, object],
    *,
    large_torque: float | None = None,
) -> Replay:
    """A fitted trial; frames of the recording outside the fit stay without a skeleton (NaN).

    Args:
        trial: fitted.
        skeleton: of the fit.
        person: whom residuals are measured against.
        settings: of the fit, as it keeps them.
        large_torque: what the joint with most rarely exceeds, in any trial [N·m]; None: in this one.
    """
    given, shown = from_dict(settings), without_guesses(trial)
    bare = unfitted_replay(trial.capture, given.conditioning)
    on_fit = _Clock(bare.times, trial.motion.start_time, trial.motion.rate, trial.motion.frames)
    feet: tuple[str, ...] = ()
    plates, notes = bare.plates, bare.notes
    predicted = predicted_wrenches(trial, skeleton)
    if trial.contacts is not None:
        notes = (*notes, *trial.contacts.notes)
        feet = trial.contacts.foot_bodies
        plates = tuple(
            PlateReplay(p.name, p.force, p.cop, on_fit.integers(trial.contacts.plate[:, i]), p.corners)
            for i, p in enumerate(plates)
        )
    bodies = _bodies(in_view(trial), skeleton, on_fit)
    return Replay(
        name=bare.name,
        times=bare.times,
        rate=bare.rate,
        markers=replace(bare.markers, model=_model_markers(trial, bare, on_fit, _known(bodies, skeleton))),
        plates=plates,
        feet=feet,
        bodies=bodies,
        residual=_residual(trial, person, on_fit),
        joints=joint_replay(shown, skeleton, bare.times),
        joint_loads=_joint_loads(shown, skeleton, on_fit, large_torque),
        required=required_forces(trial, skeleton, predicted, on_fit.floats),
        missing=_missing(trial, predicted, on_fit),
        forces=_force_use(trial, skeleton, given),
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


def _plate(
    plate: ForcePlate, times: Float[np.ndarray, " frames"], conditioning: ConditioningSettings
) -> PlateReplay:
    """The plate's sample nearest to each marker frame, less its zero level; else as it was measured."""
    clock = _Clock(times, plate.start_time, plate.rate, plate.samples)
    lowered, _ = zeroed(plate, conditioning)
    carrying = at_nearest_samples(contact_samples(lowered, conditioning), plate, times)
    force = clock.floats(lowered.force_ground)
    cop = clock.floats(plate.cop_ground)
    if lowered is not plate:
        centre = centre_of_pressure(force, clock.floats(lowered.moment_ground), surface_of(plate))
        cop = np.where(force[:, 1:2] >= SMALLEST_N, centre, np.nan)
    cop[~carrying] = np.nan
    return PlateReplay(plate.name, force, cop, np.full(len(times), -1), plate.corners_ground)


def _known(bodies: BodyReplay, skeleton: Skeleton) -> dict[str, Bool[np.ndarray, " frames"]]:
    """By marker of the model, where its segment has a pose."""
    return {marker.name: bodies.known[:, marker.body] for marker in skeleton.markers}


def _model_markers(
    trial: TrialFit, bare: Replay, on_fit: _Clock, known: Mapping[str, Bool[np.ndarray, " frames"]]
) -> Float[np.ndarray, "frames markers 3"]:
    model = np.full_like(bare.markers.measured, np.nan)
    column = {name: i for i, name in enumerate(bare.markers.names)}
    for i, name in enumerate(trial.marker_errors.names):
        if name in column:
            there = on_fit.floats(trial.model_markers_ground[:, i])
            model[:, column[name]] = np.where(known[name][:, None], there, np.nan)
    return model


def _bodies(trial: TrialFit, skeleton: Skeleton, on_fit: _Clock) -> BodyReplay:
    R_ground_body, p_ground_body = body_poses(skeleton, trial.motion.q)
    root = next((i for i, joint in enumerate(skeleton.joints) if joint.parent < 0), 0)
    return BodyReplay(
        names=skeleton.body_names,
        wxyz=on_fit.floats(quaternions(R_ground_body, scalar_first=True)),
        position=on_fit.floats(p_ground_body),
        root=root,
        forward=on_fit.floats(R_ground_body[:, root, :, 0]),
        com_body=np.stack([body.com_body for body in skeleton.bodies]),
        joints={
            body: JointCentre(joint.name, joint.p_child_frame)
            for body, joint in enumerate(skeleton.joints)
            if joint.parent >= 0
        },
    )


def _residual(trial: TrialFit, person: BodySize, on_fit: _Clock) -> ResidualReplay | None:
    if trial.dynamics is None or (trial.contacts is not None and not trial.contacts.has_plates):
        return None  # without a plate nothing was measured that anything could be left of
    weight, limits = person.mass_kg * GRAVITY, Thresholds()
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


def joint_replay(trial: TrialFit, skeleton: Skeleton, times: Float[np.ndarray, " frames"]) -> JointReplay:
    """Coordinates, speeds, torques and powers of a fitted trial; NaN outside the fit.

    Args:
        trial: fitted.
        skeleton: of the fit.
        times: of the recording's frames [s].
    """
    motion = trial.motion if trial.dynamics is None else trial.dynamics.motion
    floats = _Clock(times, motion.start_time, motion.rate, motion.frames).floats
    power = joint_power(trial)
    roots = [joint for joint in skeleton.joints if joint.parent < 0]
    return JointReplay(
        skeleton.dofs,
        tuple(coordinate.motion != "translation" for coordinate in skeleton.free_coordinates),
        floats(motion.q),
        None if trial.dynamics is None else floats(trial.dynamics.joint_torques),
        predicted=trial.forces_predicted,
        speed=floats(motion.velocity),
        power=None if power is None else floats(power),
        limits=tuple(coordinate.range for coordinate in skeleton.free_coordinates),
        of_root=frozenset(axis.coordinate for joint in roots for axis in joint.axes if axis.coordinate),
        mass_kg=skeleton.mass,
        std=trial.std and replace(trial.std, **{kind: floats(getattr(trial.std, kind)) for kind in Kind}),
    )


def _joint_loads(
    trial: TrialFit, skeleton: Skeleton, on_fit: _Clock, large: float | None
) -> JointLoads | None:
    if trial.dynamics is None:
        return None
    sizes = on_fit.floats(joint_loads(skeleton, trial.dynamics.joint_torques))
    return JointLoads(sizes, large_joint_load(skeleton, (trial,)) if large is None else large)


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
    return ForceUse.of(trial.mask, trial.proposals, confidence, phases)


def _missing(
    trial: TrialFit, predicted: Float[np.ndarray, "rows feet 6"] | None, on_fit: _Clock
) -> MissingForce | None:
    found = missing_force_of(trial, predicted)
    return found and MissingForce(on_fit.floats(found.of_feet), on_fit.floats(found.of_all))


FARTHEST_M = 0.25  # [m] from the foot's origin: about a foot's length; farther, the arrow starts at the foot
SMALLEST_N = 20.0  # [N] upwards; below it the centre of pressure is noise


def required_forces(
    trial: TrialFit,
    skeleton: Skeleton,
    wrenches: Float[np.ndarray, "rows feet 6"] | None,
    at_frames: Callable[[Float[np.ndarray, "rows 3"]], Float[np.ndarray, "frames 3"]],
) -> tuple[RequiredForce, ...]:
    """The forces of all feet that miss one on some frame; none without dynamics.

    Args:
        trial: fitted.
        skeleton: of the fit.
        wrenches: by `predicted_wrenches`.
        at_frames: from the fit's rows to the recording's frames.
    """
    if wrenches is None or trial.contacts is None or trial.mask is None:
        return ()
    p_ground_body = body_poses(skeleton, trial.motion.q)[1]
    found = []
    for i, foot in enumerate(trial.contacts.foot_bodies):
        counts = trial.mask.counts[:, i]
        if counts.all():
            continue
        force = wrenches[:, i, :3].copy()
        point = acting_point(wrenches[:, i], p_ground_body[:, skeleton.body_index(foot)])
        force[counts] = np.nan
        found.append(RequiredForce(foot, at_frames(force), at_frames(point)))
    return tuple(found)


def acting_point(
    wrench_ground: Float[np.ndarray, "frames 6"], foot_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 3"]:
    """Where on the floor the wrench has no horizontal moment [m], if that is near the foot; else below it.

    Args:
        wrench_ground: force [N] and moment about the ground origin [N·m].
        foot_ground: the foot's origin [m].
    """
    up = wrench_ground[:, 1]
    loaded = up >= SMALLEST_N
    safe = np.where(loaded, up, 1.0)
    point = np.stack([wrench_ground[:, 5] / safe, np.zeros(len(up)), -wrench_ground[:, 3] / safe], axis=1)
    under_foot = foot_ground * [1.0, 0.0, 1.0]
    near = loaded & (np.linalg.norm(point - under_foot, axis=1) <= FARTHEST_M)
    return np.where(near[:, None], point, under_foot)
