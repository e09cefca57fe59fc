import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.bones import body_meshes
from solver.skeleton.default_body import (
    MassElement,
    box,
    default_skeleton,
    ellipsoid,
    segment_element,
    together,
    without,
)
from solver.skeleton.default_frames import body_frames
from solver.skeleton.forward import body_poses, marker_positions
from solver.skeleton.segment_tables import SegmentShape, lengths

PEOPLE = [(52.0, 1.58, "female"), (70.0, 1.75, None), (95.0, 1.93, "male"), (25.0, 1.25, None)]
MIRROR = np.array([1.0, 1.0, -1.0])
ODD = {"pelvis_list", "pelvis_rotation", "pelvis_tz", "lumbar_bending", "lumbar_rotation"}


@pytest.fixture(params=PEOPLE, ids=lambda p: f"{p[0]:g}kg_{p[1]:g}m_{p[2]}")
def person(request):
    mass, height, sex = request.param
    return mass, height, sex, default_skeleton(mass_kg=mass, height_m=height, sex=sex)


def pose(skeleton, **angles_deg):
    q = skeleton.default_q.copy()
    for name, value in angles_deg.items():
        q[skeleton.dofs.index(name)] = np.radians(value)
    return q[None]


def place(skeleton, q, body):
    R, p = body_poses(skeleton, q)
    return R[0, skeleton.body_index(body)], p[0, skeleton.body_index(body)]


def whole_body(skeleton, q):
    """Centre of mass and inertia about it, summed here from the bodies."""
    R, p = body_poses(skeleton, q)
    coms = [p[0, i] + R[0, i] @ b.com_body for i, b in enumerate(skeleton.bodies)]
    com = sum(b.mass * c for b, c in zip(skeleton.bodies, coms, strict=True)) / skeleton.mass
    inertia = np.zeros((3, 3))
    for i, (b, c) in enumerate(zip(skeleton.bodies, coms, strict=True)):
        r = c - com
        inertia += R[0, i] @ b.inertia_body @ R[0, i].T + b.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return com, inertia


def test_has_22_bodies_and_37_dofs_under_opensim_names(person):
    skeleton = person[3]
    assert len(skeleton.bodies) == 22
    assert len(skeleton.dofs) == 37
    assert {"pelvis", "femur_r", "patella_l", "calcn_r", "toes_l", "torso", "hand_r"} <= set(
        skeleton.body_names
    )
    legs = {
        "hip_flexion_r",
        "hip_adduction_l",
        "hip_rotation_r",
        "knee_angle_l",
        "ankle_angle_r",
        "subtalar_angle_l",
    }
    arms = {
        "arm_flex_r",
        "arm_add_l",
        "arm_rot_r",
        "elbow_flex_l",
        "pro_sup_r",
        "wrist_flex_l",
        "wrist_dev_r",
    }
    assert legs | arms | {"pelvis_tilt", "pelvis_tx", "lumbar_extension", "mtp_angle_r"} <= set(skeleton.dofs)
    assert "knee_angle_r_beta" not in skeleton.dofs


def test_weighs_what_was_asked_for(person):
    assert person[3].mass == pytest.approx(person[0], rel=1e-12)


def test_every_body_could_be_made_of_matter(person):
    for body in person[3].bodies:
        moments = np.linalg.eigvalsh(body.inertia_body)
        assert body.mass > 0
        assert moments[0] > 0
        assert moments[0] + moments[1] > moments[2] * (1 + 1e-6), body.name
        np.testing.assert_allclose(body.inertia_body, body.inertia_body.T, atol=1e-15)


def test_left_is_the_mirror_image_of_right_in_any_pose(person):
    skeleton = person[3]
    rng = np.random.default_rng(1)
    q = skeleton.default_q + rng.uniform(-0.6, 0.6, len(skeleton.dofs))
    swapped = np.empty_like(q)
    for i, name in enumerate(skeleton.dofs):
        other = name[:-1] + {"r": "l", "l": "r"}[name[-1]] if name[-2:] in ("_r", "_l") else name
        swapped[skeleton.dofs.index(other)] = -q[i] if name in ODD else q[i]
    R, p = body_poses(skeleton, q[None])
    R_mirror, p_mirror = body_poses(skeleton, swapped[None])
    for i, body in enumerate(skeleton.bodies):
        name = body.name
        other = name[:-1] + {"r": "l", "l": "r"}[name[-1]] if name[-2:] in ("_r", "_l") else name
        j = skeleton.body_index(other)
        counterpart = skeleton.bodies[j]
        np.testing.assert_allclose(p_mirror[0, j], MIRROR * p[0, i], atol=1e-12)
        np.testing.assert_allclose(R_mirror[0, j], MIRROR[:, None] * R[0, i] * MIRROR, atol=1e-12)
        np.testing.assert_allclose(counterpart.com_body, MIRROR * body.com_body, atol=1e-15)
        np.testing.assert_allclose(
            counterpart.inertia_body, MIRROR[:, None] * body.inertia_body * MIRROR, atol=1e-15
        )


def test_stands_on_its_soles_as_tall_as_asked(person):
    _, height, sex, skeleton = person
    of = lengths(height, sex)
    frames = body_frames(of)
    _, pelvis = place(skeleton, skeleton.default_q[None], "pelvis")
    vertex = pelvis + frames.trunk_line(of.c7_above_hips + of.head)
    assert vertex[1] == pytest.approx(height, abs=1e-9)
    for body in ("calcn_r", "calcn_l", "toes_r", "toes_l"):
        _, origin = place(skeleton, skeleton.default_q[None], body)
        assert origin[1] - frames.calcn_above_sole == pytest.approx(0, abs=1e-9)


def test_centre_of_mass_is_as_high_as_measured_in_standing(person):
    """Standing people: 55 to 57.5 % of stature (Palmer 1944; Croskey et al. 1922)."""
    com, _ = whole_body(person[3], person[3].default_q[None])
    assert 0.55 < com[1] / person[1] < 0.575
    assert com[2] == pytest.approx(0, abs=1e-12)


def test_whole_body_inertia_agrees_with_the_pendulum_measurements():
    """Santschi et al. 1963 (AMRL-TDR-63-36): men of 75.5 kg and 1.76 m, upright, arms at their sides."""
    skeleton = default_skeleton(mass_kg=75.5, height_m=1.76, sex="male")
    _, inertia = whole_body(skeleton, skeleton.default_q[None])
    assert inertia[0, 0] == pytest.approx(13.0, rel=0.1)
    assert inertia[2, 2] == pytest.approx(11.6, rel=0.1)
    assert inertia[1, 1] == pytest.approx(1.28, rel=0.3)


def test_condyles_roll_back_ten_millimetres_by_120_degrees():
    skeleton = default_skeleton(mass_kg=70, height_m=1.75)
    thigh = lengths(1.75, None).thigh

    def centre_in_tibia(angle):
        q = pose(skeleton, knee_angle_r=angle)
        R_femur, p_femur = place(skeleton, q, "femur_r")
        R_tibia, p_tibia = place(skeleton, q, "tibia_r")
        return R_tibia.T @ (p_femur + R_femur @ np.array([0, -thigh, 0]) - p_tibia)

    np.testing.assert_allclose(centre_in_tibia(0), 0, atol=1e-6)
    np.testing.assert_allclose(centre_in_tibia(120), [-0.010, 0, 0], atol=1e-5)
    forward = [centre_in_tibia(angle)[0] for angle in range(0, 131, 5)]
    assert (np.diff(forward) < 1e-5).all()


@pytest.mark.parametrize(
    ("coordinate", "body", "direction"),
    [
        ("hip_flexion_r", "tibia_r", [1, 0, 0]),
        ("hip_adduction_r", "tibia_r", [0, 0, -1]),
        ("hip_adduction_l", "tibia_l", [0, 0, 1]),
        ("knee_angle_r", "talus_r", [-1, 0, 0]),
        ("ankle_angle_l", "toes_l", [0, 1, 0]),
        ("lumbar_extension", "humerus_r", [-1, 0, 0]),
        ("lumbar_bending", "humerus_r", [0, -1, 0]),
        ("lumbar_rotation", "humerus_r", [1, 0, 0]),
        ("arm_flex_l", "hand_l", [1, 0, 0]),
        ("arm_add_r", "hand_r", [0, 0, -1]),
        ("elbow_flex_r", "hand_r", [1, 0, 0]),
        ("pelvis_tilt", "torso", [-1, 0, 0]),
        ("pelvis_tx", "pelvis", [1, 0, 0]),
    ],
)
def test_positive_means_what_opensim_means(coordinate, body, direction):
    skeleton = default_skeleton()
    moved = place(skeleton, pose(skeleton, **{coordinate: 20}), body)[1]
    rest = place(skeleton, skeleton.default_q[None], body)[1]
    assert (moved - rest) @ np.array(direction) > 0.01


def test_inversion_turns_the_sole_inwards():
    skeleton = default_skeleton()
    for side, inwards in (("r", -1), ("l", 1)):
        R, _ = place(skeleton, pose(skeleton, **{f"subtalar_angle_{side}": 20}), f"calcn_{side}")
        assert (-R[:, 1])[2] * inwards > 0.1  # the sole's downward normal leans to the midline


def test_patella_follows_the_knee():
    skeleton = default_skeleton()
    R, _ = place(skeleton, pose(skeleton, knee_angle_r=90), "patella_r")
    assert np.degrees(np.arctan2(-R[1, 0], R[0, 0])) == pytest.approx(63, abs=1e-9)


def test_markers_lie_where_their_names_say():
    skeleton = default_skeleton(mass_kg=70, height_m=1.75)
    at = dict(
        zip(skeleton.marker_names, marker_positions(skeleton, skeleton.default_q[None])[0], strict=True)
    )
    assert len(at) == len(skeleton.markers)
    paired = [
        "FHD",
        "BHD",
        "SHO",
        "UPA",
        "ELB",
        "FRM",
        "WRA",
        "WRB",
        "FIN",
        "ASI",
        "PSI",
        "THI",
        "KNE",
        "TIB",
    ]
    paired += ["ANK", "HEE", "TOE"]
    plug_in_gait = {side + name for side in "LR" for name in paired} | {"C7", "T10", "CLAV", "STRN", "RBAK"}
    assert plug_in_gait <= set(at)
    for name, position in at.items():
        counterpart = "L" + name[1:]
        if name[0] == "R" and counterpart in at and name != "RBAK":
            assert position[2] > 0.01
            np.testing.assert_allclose(at[counterpart], MIRROR * position, atol=1e-12)
    heights = [
        at[n][1] for n in ("RHEE", "RANK", "RTIB", "RKNE", "RTHI", "RASI", "STRN", "RSHO", "C7", "RFHD")
    ]
    assert (np.diff(heights) > 0).all()
    assert at["RKNE"][2] > at["RKNM"][2]
    assert at["RTOE"][0] > at["RHEE"][0] + 0.15
    assert at["RWRA"][2] > at["RWRB"][2]  # palms forward: the thumb's side is outwards


def test_bony_places_are_flagged_and_clusters_are_not():
    flags = {m.name: m.fixed for m in default_skeleton().markers}
    assert all(flags[n] for n in ("RASI", "LPSI", "RKNE", "LANK", "RHEE", "C7"))
    assert not any(flags[n] for n in ("RTH1", "LTH2", "RTB3", "LTHI", "RUA1"))


@pytest.mark.parametrize(
    "wrong", [{"mass_kg": 70000}, {"height_m": 175}, {"height_m": float("nan")}, {"sex": "m"}]
)
def test_says_what_no_person_can_be(wrong):
    with pytest.raises(ModelError):
        default_skeleton(**wrong)


def test_bodies_by_their_share_of_the_mass(person):
    """Trunk and thighs have a tenth at least, hands and toes less than a hundredth, whoever it is."""
    mass, _, _, skeleton = person
    names = {skeleton.body_names[b] for b in skeleton.bodies_from_share(0.1)}
    assert names == {b.name for b in skeleton.bodies if b.mass > 0.1 * mass}
    assert {"torso", "femur_r", "femur_l"} <= names
    assert skeleton.bodies_from_share(0.0) == tuple(range(len(skeleton.bodies)))


@pytest.fixture(scope="module")
def drawn():
    skeleton = default_skeleton(mass_kg=80, height_m=1.85, sex="male")
    bones = body_meshes(skeleton)
    R, p = body_poses(skeleton, skeleton.default_q[None])
    extent = {}
    for i, body in enumerate(skeleton.bodies):
        vertices = bones.meshes[body.name].vertices @ R[0, i].T + p[0, i]
        extent[body.name] = (vertices.min(axis=0), vertices.max(axis=0), p[0, i])
    return bones, extent


def test_every_body_has_its_bones(drawn):
    bones, extent = drawn
    assert len(extent) == 22
    assert bones.notes == ()


def test_long_bones_reach_from_joint_to_joint(drawn):
    _, extent = drawn
    for upper, lower in (("femur_r", "tibia_r"), ("tibia_l", "talus_l"), ("humerus_r", "ulna_r")):
        low, high, origin = extent[upper]
        assert high[1] - origin[1] < 0.05
        assert low[1] == pytest.approx(extent[lower][2][1], abs=0.04)


def test_the_skull_fills_the_stature_and_the_feet_stand_on_the_floor(drawn):
    _, extent = drawn
    assert 1.85 - 0.06 < extent["torso"][1][1] < 1.85
    for body in ("calcn_r", "toes_l"):
        assert 0.0 < extent[body][0][1] < 0.025
    assert extent["toes_r"][1][0] - extent["calcn_r"][0][0] == pytest.approx(0.152 * 1.85, abs=0.03)


def test_bones_are_alike_on_both_sides(drawn):
    _, extent = drawn
    for name in ("femur", "calcn", "humerus", "radius"):
        right, left = extent[f"{name}_r"], extent[f"{name}_l"]
        np.testing.assert_allclose(right[0][:2], left[0][:2], atol=0.003)
        np.testing.assert_allclose(right[1][2], -left[0][2], atol=0.003)


def cloud_of(element, rng):
    """Eight equal point masses with the element's mass, centre and inertia."""
    second = np.trace(element.inertia) / 2 * np.eye(3) - element.inertia  # ∫ x xᵀ dm
    values, axes = np.linalg.eigh(second)
    arms = axes * np.sqrt(np.maximum(values, 0) / element.mass)
    signs = np.array([[a, b, c] for a in (1, -1) for b in (1, -1) for c in (1, -1)])
    return element.com + signs @ arms.T, np.full(8, element.mass / 8)


def of_points(points, masses):
    com = masses @ points / masses.sum()
    r = points - com
    inertia = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, r, strict=True))
    return masses.sum(), com, inertia


@pytest.fixture
def parts():
    rng = np.random.default_rng(0)
    return [
        ellipsoid(2.0, rng.normal(size=3), np.array([0.1, 0.3, 0.2])),
        box(1.5, rng.normal(size=3), np.array([0.4, 0.2, 0.6])),
    ]


def test_a_sum_is_what_point_masses_make_of_it(parts):
    rng = np.random.default_rng(1)
    clouds = [cloud_of(part, rng) for part in parts]
    mass, com, inertia = of_points(
        np.concatenate([c[0] for c in clouds]), np.concatenate([c[1] for c in clouds])
    )
    whole = together(parts)
    assert whole.mass == pytest.approx(mass)
    np.testing.assert_allclose(whole.com, com, atol=1e-12)
    np.testing.assert_allclose(whole.inertia, inertia, atol=1e-12)


def test_taking_a_part_away_undoes_adding_it(parts):
    left = without(together(parts), parts[1:])
    assert left.mass == pytest.approx(parts[0].mass)
    np.testing.assert_allclose(left.com, parts[0].com, atol=1e-12)
    np.testing.assert_allclose(left.inertia, parts[0].inertia, atol=1e-12)


def test_a_segment_lies_along_its_end_points():
    shape = SegmentShape(
        mass=0.1, com=0.4, radius_sagittal=0.3, radius_transverse=0.25, radius_longitudinal=0.1
    )
    start, end = np.array([0.1, 0.2, 0.3]), np.array([0.3, -0.4, 0.4])
    element = segment_element(shape, 70.0, start, end)
    length = np.linalg.norm(end - start)
    along = (end - start) / length
    assert element.mass == pytest.approx(7.0)
    np.testing.assert_allclose(element.com, start + 0.4 * (end - start), atol=1e-15)
    assert along @ element.inertia @ along == pytest.approx(7.0 * (0.1 * length) ** 2)
    moments = np.sqrt(np.linalg.eigvalsh(element.inertia) / 7.0) / length
    np.testing.assert_allclose(moments, [0.1, 0.25, 0.3], rtol=1e-9)


def test_moving_changes_the_inertia_about_a_fixed_point_only():
    element = MassElement(2.0, np.array([0.1, 0.0, 0.0]), np.eye(3))
    moved = element.moved(np.array([0.0, 0.3, 0.0]))
    np.testing.assert_array_equal(moved.inertia, element.inertia)
    assert moved.inertia_about(np.zeros(3))[2, 2] == pytest.approx(1 + 2 * (0.01 + 0.09))
