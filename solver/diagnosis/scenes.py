"""From a fit to what the diagnosis looks at: each trial's motion by its markers alone, beside its plates."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import plate_loads
from solver.common.frames_at_once import by_frames
from solver.contact.force_review import ForceReview
from solver.contact.mask import mask_of, with_own_file
from solver.contact.sole import independent_feet, soles
from solver.contact.wrenches import MissingRange
from solver.diagnosis.causes.observed_trial import MarkerScene, PlateScene, Scene
from solver.dynamics.force_prediction.marker_noise import MarkerNoise
from solver.dynamics.force_prediction.marker_posterior import (
    LongMarkerPosterior,
    MarkerPosterior,
    trial_posterior,
)
from solver.dynamics.force_prediction.missing_wrench import FEWEST_FRAMES
from solver.dynamics.inertia_parameters import pseudo_inertia, required_wrench
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.dynamics.trajectory.marker_error_levels import POSE_SLOW_M
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.settings import Settings
from solver.kinematics.model_ownership import SAME_MASS
from solver.markers.label_families import seen_as_poses
from solver.skeleton.forward import ForwardKinematics, body_poses, marker_positions
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton
from solver.skeleton.subject_model import load_subject_model

LONG_M = 0.2  # shorter segments are measured by too few markers
FEWEST_SEGMENTS = 4
ALIKE_LOG_STD = 0.0055  # standard deviation of log lengths, weighted with length, about their mean

Posterior = MarkerPosterior | LongMarkerPosterior
SceneAndPosterior = list[tuple[Scene, Posterior]]  # of each trial


def observed_markers(fit: TrialFit, skeleton: Skeleton) -> Float[np.ndarray, "frames markers 3"]:
    """The recording's markers in the model's order; NaN where unseen, not in it, or without a pose [m]."""
    recorded = fit.capture.markers
    fitted = set(fit.marker_errors.names)
    observed = np.full((recorded.frames, len(skeleton.markers), 3), np.nan)
    for m, marker in enumerate(skeleton.markers):
        if marker.name in fitted and marker.name in recorded.names:
            observed[:, m] = recorded.positions_ground[:, recorded.names.index(marker.name)]
    observed[~fit.motion.posed] = np.nan
    return observed


def scene_of(
    fit: TrialFit, skeleton: Skeleton, settings: Settings, flagged: Sequence[MissingRange] = ()
) -> tuple[Scene, Posterior]:
    """One trial with forces.

    Args:
        fit: of the markers; its contacts and proposals are of use, its mask is not.
        skeleton: scaled, with the entered mass.
        settings: of solve and diagnosis.
        flagged: what a person took out; only a person does.
    """
    assert fit.contacts is not None
    start = (fit.kinematics_only.motion if fit.kinematics_only else fit.motion).filled()
    observed = observed_markers(fit, skeleton)
    noise = noise_of_markers(skeleton, settings.diagnosis)
    posterior = trial_posterior(skeleton, observed, start, noise, settings.trajectory)
    kinematics = ForwardKinematics(skeleton)
    motion = posterior.motion.low_passed(settings.diagnosis.signature_cutoff_Hz)
    v, a = motion.velocity, motion.acceleration
    R_ground_body, p_ground_body = body_poses(skeleton, motion.q)
    material = by_frames(
        lambda *state: material_accelerations(kinematics, kinematics.poses(state[0]), *state)[0],
        motion.q,
        v,
        a,
    )
    scene = Scene(
        name=fit.capture.name,
        skeleton=skeleton,
        motion=motion,
        velocity=v,
        acceleration=a,
        R_ground_body=R_ground_body,
        p_ground_body=p_ground_body,
        material=material,
        com_ground=centre_of_mass_of(skeleton, motion.q),
        required_ground=_required(kinematics, posterior),
        plates=tuple(_plate(k, plate, fit, settings) for k, plate in enumerate(fit.capture.plates)),
        markers=MarkerScene(
            skeleton.marker_names, kinematics.marker_bodies, observed, marker_positions(skeleton, motion.q)
        ),
        soles=tuple(soles(skeleton, independent_feet(skeleton, fit.contacts.foot_bodies))),
        contacts=fit.contacts,
        proposals=fit.proposals,
        counts=_counts(fit, settings, flagged),
        contact_settings=settings.contact,
        trajectory_settings=settings.trajectory,
        notes=fit.capture.notes,
    )
    return scene, posterior


def noise_of_markers(skeleton: Skeleton, settings: DiagnosisSettings) -> MarkerNoise:
    """As the settings have it; poses err more slowly than markers."""
    noise, is_poses = settings.markers, seen_as_poses(skeleton.marker_names)
    return replace(noise, least_m=max(noise.least_m, POSE_SLOW_M)) if is_poses else noise


def _required(kinematics: ForwardKinematics, posterior: Posterior) -> Float[np.ndarray, "frames 6"]:
    """The wrench that the markers' own motion demands, about the ground origin [N], [N·m].

    Not of the smoother motion that signatures are computed from: a signature that shares the markers' noise
    with the balance would explain that noise.
    """
    J = np.stack([pseudo_inertia(body) for body in kinematics.skeleton.bodies])

    def required(*state: Float[np.ndarray, "some dofs"]) -> Float[np.ndarray, "some 6"]:
        q, v, a = state
        A, T = material_accelerations(kinematics, kinematics.poses(q), q, v, a)
        return required_wrench(A, T, J).sum(axis=1)

    return by_frames(required, posterior.motion.q, posterior.velocity, posterior.acceleration)


def scenes_of(fit: Fit, settings: Settings, reviews: Mapping[str, ForceReview]) -> SceneAndPosterior:
    """All trials of a fit that have forces, and frames enough for accelerations."""
    size = size_against_own_model(fit)
    entered, factor = fit.subject.mass_kg is not None, fit.subject.scale_factor
    skeleton = fit.skeleton if factor is None else with_mass(fit.skeleton, fit.skeleton.mass / factor)
    pairs = [
        scene_of(trial, skeleton, settings, flagged_by_people(trial, reviews))
        for trial in fit.trials
        if trial.contacts is not None and trial.contacts.has_plates and trial.motion.frames >= FEWEST_FRAMES
    ]
    return [
        (
            replace(scene, size_against_own_model=size, mass_was_entered=entered, scale_factor=factor),
            posterior,
        )
        for scene, posterior in pairs
    ]


def flagged_by_people(fit: TrialFit, reviews: Mapping[str, ForceReview]) -> Sequence[MissingRange]:
    """What people, and an imported review, leave out of a trial; what only detection does is a hypothesis."""
    review = with_own_file(reviews.get(fit.capture.name) or ForceReview(), fit.capture)
    feet = fit.contacts.foot_bodies if fit.contacts else ()
    return mask_of(feet, fit.motion.frames, (), replace(review, stays_out=())).reasons


def _plate(k: int, plate: ForcePlate, fit: TrialFit, settings: Settings) -> PlateScene:
    loads = plate_loads(plate, settings.conditioning)
    scene = PlateScene(
        target=f"plate_{k + 1}",
        plate=plate,
        loads=loads,
        wrench_ground=np.zeros((fit.motion.frames, 6)),
        loaded=np.zeros(fit.motion.frames, dtype=bool),
        centre_ground=_centre(plate, loads.carrying),
        times=fit.motion.times,
        conditioning=settings.conditioning,
    )
    wrench = np.nan_to_num(scene.at_frames(loads.wrench_ground))
    return replace(scene, wrench_ground=wrench, loaded=wrench[:, 1] >= settings.conditioning.threshold_N)


def _centre(plate: ForcePlate, carrying: Bool[np.ndarray, " samples"]) -> Float[np.ndarray, "3"]:
    if plate.corners_ground is not None:
        return np.asarray(plate.corners_ground.mean(axis=0))
    pressed = plate.cop_ground[carrying & np.isfinite(plate.cop_ground).all(axis=1)]
    if not len(pressed):
        return np.zeros(3)
    return (pressed.max(axis=0) + pressed.min(axis=0)) / 2


def _counts(
    fit: TrialFit, settings: Settings, flagged: Sequence[MissingRange]
) -> Bool[np.ndarray, " frames"]:
    assert fit.contacts is not None
    counts = fit.contacts.observed & (fit.marker_errors.seen_share >= settings.kinematics.fewest_seen_share)
    for start, end, _, _ in flagged:
        counts[start:end] = False
    return counts


def size_against_own_model(fit: Fit) -> float | None:
    """Logarithm of the fitted body's size over its own model's; None where the model is nobody's.

    A model is taken for the person's own if it weighs what was entered and all its long segments call for the
    same factor. Over 140 simulated persons with their own model that factor's logarithm scattered by 0.0015.
    """
    if fit.subject.model is None or fit.subject.mass_kg is None:
        return None
    model = load_subject_model(fit.subject.model)
    if abs(model.mass / fit.subject.mass_kg - 1) > SAME_MASS:
        return None
    before, after = _lengths_m(model), _lengths_m(fit.skeleton)
    long = [pair for pair, length in before.items() if length > LONG_M and pair in after]
    if len(long) < FEWEST_SEGMENTS:
        return None
    weight = np.array([before[pair] for pair in long])
    ratio = np.log([after[pair] / before[pair] for pair in long])
    mean = float(weight @ ratio / weight.sum())
    scatter = float(np.sqrt(weight @ (ratio - mean) ** 2 / weight.sum()))
    return mean if scatter < ALIKE_LOG_STD else None


def _lengths_m(skeleton: Skeleton) -> dict[tuple[str, str], float]:
    """From a body's own joint to that of each body that it carries."""
    names = skeleton.body_names
    return {
        (names[joint.parent], names[child]): float(
            np.linalg.norm(joint.p_parent_frame - skeleton.joints[joint.parent].p_child_frame)
        )
        for child, joint in enumerate(skeleton.joints)
        if joint.parent >= 0
    }
