"""Somebody stands still on plates: all of them together weigh the person, whatever foot is on which."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.capture.capture import Capture, ForcePlate, Markers, Subject
from solver.common.progress import silent
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.fitting.fit_result import Groundwork
from solver.fitting.model_stage import scale_model, weigh_who_stands
from solver.fitting.settings import Settings
from solver.fitting.state import FitState, Recordings
from solver.fitting.tracking_stage import leave_out_turning_head
from solver.kinematics.marker_matching import match_markers
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.rotations import rotation_about
from solver.skeleton.skeleton import Skeleton

MASS_KG, RATE, FRAMES = 86.0, 100.0, 150
NOBODY = Subject(folder=Path("nobody"), trials=())
FLOOR = (-0.5, 0.5, -0.5, 0.5)  # x and z [m] under the person, who stands about the origin


@pytest.fixture(scope="module")
def body() -> Skeleton:
    return default_skeleton(height_m=1.72)


def pose(body: Skeleton, **angles: float) -> np.ndarray:
    q = np.tile(body.default_q, (FRAMES, 1))
    for name, value in angles.items():
        q[:, body.dofs.index(name)] = value
    return q


def standing(body: Skeleton, q: np.ndarray, rng: np.random.Generator) -> Markers:
    positions = marker_positions(body, q)
    return Markers(body.marker_names, positions + rng.normal(0, 0.0005, positions.shape), RATE)


def middle(body: Skeleton, markers: Markers, side: str) -> np.ndarray:
    """Below a foot."""
    own = [m for m, marker in enumerate(body.markers) if body.body_names[marker.body] == f"calcn_{side}"]
    return markers.positions_ground[:, own].mean(axis=(0, 1)) * [1, 0, 1]


def com(body: Skeleton) -> np.ndarray:
    """On the ground below it."""
    return centre_of_mass_of(body, pose(body))[0] * [1, 0, 1]


def plate(name: str, newtons: float, at: np.ndarray, rectangle, rng: np.random.Generator) -> ForcePlate:
    force = np.tile([0.0, newtons, 0.0], (FRAMES, 1)) + rng.normal(0, 1.0, (FRAMES, 3))
    x0, x1, z0, z1 = rectangle
    corners = np.array([[x0, 0, z0], [x1, 0, z0], [x1, 0, z1], [x0, 0, z1]])
    moment = np.cross(np.tile(at, (FRAMES, 1)), force)
    return ForcePlate(name, force, moment, np.tile(at, (FRAMES, 1)), RATE, corners_ground=corners)


def weigh(body: Skeleton, markers: Markers, plates, subject: Subject = NOBODY):
    recordings = Recordings(body, (Capture("trial", markers, tuple(plates)),), None, {})
    groundwork = Groundwork(body, match_markers(body, [markers]), ())
    state = FitState(subject, groundwork, body, read=recordings)
    return weigh_who_stands(state, Settings()).groundwork.standing


@pytest.mark.parametrize("shares", [(1.0,), (0.6, 0.4), (0.1, 0.5, 0.22, 0.18)])
@pytest.mark.parametrize("seed", [0, 1])
def test_plates_are_summed_however_the_weight_is_shared(body, shares, seed):
    """Feet on edges: no plate's pressure lies under a foot of its own, and some carry both."""
    rng = np.random.default_rng(seed)
    markers = standing(body, pose(body), rng)
    beside = rng.normal(0, 0.1, (len(shares), 3)) * [1, 0, 1]
    beside += com(body) - np.average(beside, axis=0, weights=shares)  # nobody falls
    plates = [
        plate(f"plate {k}", share * MASS_KG * 9.80665, beside[k], FLOOR, rng)
        for k, share in enumerate(shares)
    ]
    (found,) = weigh(body, markers, plates)
    assert found.mass.mass_kg == pytest.approx(MASS_KG, rel=0.01)
    assert abs(found.mass.mass_kg - MASS_KG) < 3 * found.mass.std_kg


def test_what_plates_beside_the_feet_read_is_not_of_this_person(body):
    """Somebody else, or a zero level: the plate under both feet presses below the body by itself."""
    rng = np.random.default_rng(5)
    markers = standing(body, pose(body), rng)
    own = plate("plate 1", MASS_KG * 9.80665, com(body), FLOOR, rng)
    others = [
        plate(f"plate {k + 2}", 150.0, com(body) + np.array([0.6, 0, 0.2 * k]), (0.5, 1.0, -0.5, 0.5), rng)
        for k in (0, 1)
    ]
    (found,) = weigh(body, markers, [*others, own])
    assert found.mass.mass_kg == pytest.approx(MASS_KG, rel=0.01)
    assert found.name == "plate 1 of trial"


def test_a_foot_on_the_floor_beside_the_plates_is_no_weighing(body):
    rng = np.random.default_rng(2)
    markers = standing(body, pose(body, hip_adduction_r=-0.1, hip_adduction_l=-0.1), rng)
    right = middle(body, markers, "r")
    half = plate("plate 1", 0.5 * MASS_KG * 9.80665, right, (-0.5, 0.5, 0.02, 0.5), rng)
    assert weigh(body, markers, [half]) == ()


def test_who_sits_or_moves_or_steps_on_is_not_weighed(body):
    rng = np.random.default_rng(3)
    sitting = standing(
        body, pose(body, hip_flexion_r=1.5, hip_flexion_l=1.5, knee_angle_r=1.5, knee_angle_l=1.5), rng
    )
    upright = standing(body, pose(body), rng)
    drift = np.linspace(0, 0.5, FRAMES)[:, None, None] * np.array([1.0, 0, 0])
    moving = replace(upright, positions_ground=upright.positions_ground + drift)
    whole = plate("plate 1", MASS_KG * 9.80665, middle(body, upright, "r") * [1, 0, 0], FLOOR, rng)
    stepping = replace(whole, force_ground=whole.force_ground * np.linspace(0.3, 1, FRAMES)[:, None])
    assert weigh(body, upright, [whole])
    assert weigh(body, sitting, [whole]) == ()
    assert weigh(body, moving, [whole]) == ()
    assert weigh(body, upright, [stepping]) == ()


def test_an_entered_mass_needs_no_weighing(body):
    rng = np.random.default_rng(4)
    markers = standing(body, pose(body), rng)
    whole = plate("plate 1", MASS_KG * 9.80665, middle(body, markers, "r") * [1, 0, 0], FLOOR, rng)
    assert weigh(body, markers, [whole], replace(NOBODY, mass_kg=80.0)) == ()


def test_of_several_recordings_the_mirrored_one_is_named(body):
    x = marker_positions(body, pose(body))[:2]
    markers = Markers(body.marker_names, x, RATE)
    mirrored = replace(markers, positions_ground=markers.positions_ground * (1, 1, -1))
    captures = tuple(Capture(name, seen, ()) for name, seen in (("walk", markers), ("turn", mirrored)))
    groundwork = Groundwork(body, match_markers(body, [markers]), ())
    state = FitState(NOBODY, groundwork, body, read=Recordings(body, captures, None, {}))
    notes = scale_model(state, Settings(), silent).groundwork.notes
    assert [note.trial for note in notes if "left and right are exchanged" in note] == ["turn"]


def test_of_a_turning_head_fit_and_figures_go_without_its_markers(body):
    markers = Markers(body.marker_names, marker_positions(body, pose(body)), RATE)
    head = [i for i, name in enumerate(markers.names) if name in ("RFHD", "LFHD", "RBHD", "LBHD")]
    turn = rotation_about(np.array([0.0, 1.0, 0.0]), np.linspace(-1.0, 1.0, FRAMES)).transpose(0, 2, 1)
    markers.positions_ground[:, head] = markers.positions_ground[:, head] @ turn
    groundwork = Groundwork(body, match_markers(body, [markers]), ())
    recordings = Recordings(body, (Capture("swing", markers, ()),), None, {})
    left = leave_out_turning_head(FitState(NOBODY, groundwork, body, read=recordings))
    assert set(body.marker_names) - set(left.groundwork.match.model) == {"RFHD", "LFHD", "RBHD", "LBHD"}
    assert left.skeleton.marker_names == left.groundwork.skeleton.marker_names == left.groundwork.match.model
    assert "the model has no neck, and the head turned by up to 57°" in left.groundwork.notes[-1]
