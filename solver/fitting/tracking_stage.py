"""A trial's motion from its markers alone, and its forces given to feet."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Capture, Subject
from solver.capture.plates.conditioning import condition
from solver.common.cpu_timer import CpuTimer
from solver.common.errors import ModelError
from solver.common.progress import Progress
from solver.contact.assignment import assign
from solver.contact.needed_segments import seen_legs, unseen_coordinates, why_not_predicted
from solver.contact.sole import independent_feet, soles
from solver.contact.wrenches import unmeasured
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.fitting.fit import Groundwork, TrialFit
from solver.fitting.settings import Settings
from solver.kinematics.determined import left_open
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.marker_errors import marker_errors
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import body_poses, marker_positions
from solver.skeleton.skeleton import Skeleton


def tracked_trial(
    capture: Capture, groundwork: Groundwork, settings: Settings, progress: Progress
) -> TrialFit:
    """Inverse kinematics of one trial."""
    cpu_timer = CpuTimer()
    with cpu_timer("kinematics"):
        measured = groundwork.match.observed(capture.markers)
        q = inverse_kinematics(
            groundwork.skeleton, measured, capture.markers.rate, settings.kinematics, progress
        )
    return replace(compared(capture, groundwork, q, settings), seconds=cpu_timer.seconds)


def compared(
    capture: Capture, groundwork: Groundwork, q: Float[np.ndarray, "frames dofs"], settings: Settings
) -> TrialFit:
    """A trial's marker fit, compared with its markers."""
    markers, match, skeleton = capture.markers, groundwork.match, groundwork.skeleton
    model_markers = marker_positions(skeleton, q)
    observed = match.observed(markers)
    errors, notes = marker_errors(skeleton, match.model, model_markers, observed, settings.kinematics)
    return TrialFit(
        capture=capture,
        motion=Motion(skeleton.dofs, q, markers.rate, markers.start_time),
        marker_errors=errors,
        model_markers_ground=model_markers,
        notes=notes,
        left_open=left_open(skeleton, observed, q, settings.kinematics),
        unseen_coordinates=unseen_coordinates(match.skeleton(skeleton), observed),
    )


def with_contacts(fit: TrialFit, groundwork: Groundwork, subject: Subject, settings: Settings) -> TrialFit:
    """The trial's forces given to feet that are seen; feet without a force where the trial has none."""
    skeleton, q, times = groundwork.skeleton, fit.motion.q, fit.motion.times
    unseen, com = fit.unseen_coordinates, centre_of_mass_of(skeleton, q)
    why = why_not_predicted(skeleton, q, unseen, subject.foot_bodies, com)
    fit = replace(fit, why_not_predicted=why)
    if not fit.capture.plates or not seen_legs(skeleton, unseen, subject.foot_bodies):
        return _without_forces(fit, skeleton, subject)
    conditioned = [condition(plate, times, settings.conditioning) for plate in fit.capture.plates]
    R, p = body_poses(skeleton, q)
    contacts = assign(
        conditioned,
        R,
        p,
        skeleton=skeleton,
        foot_bodies=subject.foot_bodies,
        times=times,
        settings=settings.contact,
    )
    return replace(fit, contacts=contacts)


def _without_forces(fit: TrialFit, skeleton: Skeleton, subject: Subject) -> TrialFit:
    """Feet to predict forces for, if the model has some and hangs freely on the ground."""
    try:
        feet = independent_feet(skeleton, subject.foot_bodies)
        soles(skeleton, feet)
        root_joint(skeleton)
    except ModelError as error:
        return replace(fit, notes=(*fit.notes, f"no forces are recorded and none predicted: {error}"))
    return replace(fit, contacts=unmeasured(feet, fit.motion.frames))
