"""Scenes of other markers than those recorded, and slips in them."""

from dataclasses import replace

import numpy as np

from solver.diagnosis.causes.effect import Estimate, Range
from solver.diagnosis.causes.marker_slip import MarkerSlip
from solver.diagnosis.causes.observed_trial import MarkerScene, Scene
from solver.fitting.settings import Settings
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.motion import Motion
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import MeasurementSettings, recorded_markers
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

RATE = 100.0
SHIFT_M = np.array([0.02, -0.01, 0.005])


def track(
    scene: Scene, observed_ground: np.ndarray, skeleton: Skeleton | None = None, rate: float = RATE
) -> Scene:
    """A scene of these markers, with the motion that inverse kinematics finds for them."""
    skeleton = skeleton or scene.skeleton
    q = inverse_kinematics(skeleton, observed_ground, rate, Settings().kinematics)
    kinematics = ForwardKinematics(skeleton)
    poses = kinematics.poses(q)
    markers = MarkerScene(
        skeleton.marker_names, kinematics.marker_bodies, observed_ground, kinematics.markers(poses)
    )
    return replace(
        scene,
        skeleton=skeleton,
        motion=Motion(skeleton.dofs, q, rate),
        R_ground_body=poses.R_ground_body,
        p_ground_body=poses.p_ground_body,
        markers=markers,
    )


def record_markers(person: Person, scenario: Scenario, seed: int) -> tuple[np.ndarray, Skeleton]:
    """Somebody's markers with noise, gaps and skin, and the skeleton that orders them."""
    body_rng, motion_rng, noise_rng = np.random.default_rng(seed).spawn(3)
    body = body_of(person, body_rng)
    trial = simulate_trial(scenario, body, motion_rng)
    seen = recorded_markers(trial, MARKERS, MeasurementSettings(), noise_rng)
    observed = np.full((seen.frames, len(body.skeleton.markers), 3), np.nan)
    for m, name in enumerate(seen.names):
        observed[:, body.skeleton.marker_names.index(name)] = seen.positions_ground[:, m]
    return observed, body.skeleton


def slip(
    scene: Scene, marker: int, frame: int = 100, size_m: float = 0.02, trial: str | None = None
) -> MarkerSlip:
    """As if it had been found."""
    return MarkerSlip(
        target=scene.markers.names[marker],
        parameters={"shift_m": Estimate(size_m, 0.001), "time_s": Estimate(frame / scene.rate, 0.01)},
        frames=Range(trial or scene.name, frame, scene.frames),
        gain=40.0,
        marker=marker,
        body=int(scene.markers.body[marker]),
        shift_body=SHIFT_M,
        R_ground_body=scene.R_ground_body[:, scene.markers.body[marker]],
    )
