"""Reading OpenSim models: what a construct means, and what a bad file is told."""

import numpy as np
import pytest

from solver.errors import ModelError
from solver.skeleton.forward import body_poses
from solver.skeleton.functions import Constant, CubicSpline, Linear, PiecewiseLinear, Polynomial, Scaled
from solver.skeleton.osim import load_skeleton
from solver.skeleton.rotations import body_fixed_xyz

STANDARD = {
    "WeldJoint": 0,
    "PinJoint": 1,
    "SliderJoint": 1,
    "UniversalJoint": 2,
    "BallJoint": 3,
    "GimbalJoint": 3,
    "FreeJoint": 6,
    "PlanarJoint": 3,
}
PIN_A = (
    '<PinJoint name="base"><socket_parent_frame>/ground</socket_parent_frame>'
    '<socket_child_frame>/bodyset/a</socket_child_frame><coordinates><Coordinate name="q"/></coordinates></PinJoint>'
)
PIN_B = (
    '<PinJoint name="elbow"><socket_parent_frame>/bodyset/a</socket_parent_frame>'
    '<socket_child_frame>/bodyset/b</socket_child_frame><coordinates><Coordinate name="r"/></coordinates></PinJoint>'
)


@pytest.fixture
def load(tmp_path):
    def load(text):
        path = tmp_path / "small model é.osim"
        path.write_text(text, encoding="utf-8")
        return load_skeleton(path)

    return load


def custom(axes: str, coordinates: str = '<Coordinate name="q"/>') -> str:
    return (
        '<CustomJoint name="base"><socket_parent_frame>/ground</socket_parent_frame>'
        f"<socket_child_frame>/bodyset/a</socket_child_frame><coordinates>{coordinates}</coordinates>"
        f"<SpatialTransform>{axes}</SpatialTransform></CustomJoint>"
    )


def axis(name: str, coordinates: str, direction: str, function: str) -> str:
    return (
        f'<TransformAxis name="{name}"><coordinates>{coordinates}</coordinates>'
        f"<axis>{direction}</axis>{function}</TransformAxis>"
    )


def line(*coefficients: float) -> str:
    numbers = " ".join(map(str, coefficients))
    return f'<LinearFunction name="function"><coefficients>{numbers}</coefficients></LinearFunction>'


STILL = '<Constant name="function"><value>0</value></Constant>'
ACROSS = axis("rotation2", "", "1 0 0", STILL) + axis("rotation3", "", "0 1 0", STILL)


# ---- what constructs mean -------------------------------------------------------------------------------


@pytest.mark.opensim
@pytest.mark.parametrize("kind", STANDARD)
@pytest.mark.parametrize("layout", [3, 4])
def test_standard_joints_move_as_in_opensim(kind, layout, load, referee, tmp_path, document3, document4):
    named = "".join(f'<Coordinate name="q{i}"/>' for i in range(STANDARD[kind]))
    if layout == 4:
        frames = "".join(
            f'<PhysicalOffsetFrame name="{name}"><socket_parent>{parent}</socket_parent>'
            "<translation>0.1 -0.2 0.3</translation><orientation>0.4 0.5 -0.6</orientation></PhysicalOffsetFrame>"
            for name, parent in (("p", "/ground"), ("c", "../../../bodyset/a"), ("p2", "../p"))
        )
        text = document4(
            f'<{kind} name="j"><socket_parent_frame>p2</socket_parent_frame><socket_child_frame>c</socket_child_frame>'
            f"<coordinates>{named}</coordinates><frames>{frames}</frames></{kind}>"
        )
    else:
        text = document3(
            f'<{kind} name="j"><parent_body>ground</parent_body><location_in_parent>0.1 0.2 0.3</location_in_parent>'
            "<orientation_in_parent>0.4 0.5 -0.6</orientation_in_parent><location>-0.3 0.2 0</location>"
            f"<orientation>0 0.7 0</orientation><CoordinateSet><objects>{named}</objects></CoordinateSet></{kind}>"
        )
    skeleton = load(text)
    theirs = referee(tmp_path / "small model é.osim", skeleton)
    _assert_same_pose(skeleton, theirs, np.linspace(0.2, 0.9, STANDARD[kind]))


@pytest.mark.opensim
@pytest.mark.parametrize("reverse", ["true", "false"])
@pytest.mark.parametrize("kind", ["PinJoint", "GimbalJoint", "SliderJoint"])
def test_reversed_joints_move_as_in_opensim(kind, reverse, load, referee, tmp_path, document3):
    names = "".join(f'<Coordinate name="q{i}"/>' for i in range(STANDARD[kind]))
    skeleton = load(
        document3(
            f'<{kind} name="j"><parent_body>ground</parent_body><location_in_parent>1 0 0</location_in_parent>'
            f"<location>0 2 0</location><orientation>0 0.7 0</orientation><CoordinateSet><objects>{names}</objects>"
            f"</CoordinateSet><reverse>{reverse}</reverse></{kind}>"
        )
    )
    theirs = referee(tmp_path / "small model é.osim", skeleton)
    _assert_same_pose(skeleton, theirs, np.linspace(0.2, 0.9, STANDARD[kind]))


@pytest.mark.opensim
def test_coordinates_follow_the_joints_and_the_axes_not_the_lists(load, referee, tmp_path, document4):
    """OpenSim orders by JointSet, then by first use in the SpatialTransform."""
    axes = (
        axis("rotation1", "turn", "0 0 1", line(1, 0))
        + axis("rotation2", "bow", "1 0 0", line(-1, 0.1))
        + axis("rotation3", "", "0 1 0", STILL)
        + axis("translation1", "slide", "2 1 0", line(2, 0.5))
        + axis("translation2", "", "0 1 0", STILL)
        + axis("translation3", "", "0 0 1", '<Constant name="function"><value>0.3</value></Constant>')
    )
    listed = "".join(f'<Coordinate name="{name}"/>' for name in ("slide", "bow", "turn"))
    skeleton = load(document4(PIN_B + custom(axes, listed), bodies="b a"))
    theirs = referee(tmp_path / "small model é.osim", skeleton)
    names = [c.getName() for c in theirs.coordinates]
    assert [c.name for c in skeleton.coordinates] == names == ["r", "turn", "bow", "slide"]
    assert [c.motion for c in skeleton.coordinates] == ["rotation", "rotation", "rotation", "coupled"]
    assert skeleton.body_names == ("a", "b")
    _assert_same_pose(skeleton, theirs, np.array([0.3, 0.4, -0.5, 0.1]))


@pytest.mark.opensim
def test_a_coupler_scales_its_function(load, referee, tmp_path, document4):
    coupler = (
        '<ConstraintSet><objects><CoordinateCouplerConstraint name="c"><coupled_coordinates_function>'
        f"{line(3, 0.1)}</coupled_coordinates_function><independent_coordinate_names>q</independent_coordinate_names>"
        "<dependent_coordinate_name>r</dependent_coordinate_name><scale_factor>2</scale_factor>"
        "</CoordinateCouplerConstraint></objects></ConstraintSet>"
    )
    skeleton = load(document4(PIN_A + PIN_B, "a b", coupler))
    theirs = referee(tmp_path / "small model é.osim", skeleton)
    theirs.coordinates[0].setValue(theirs.state, 0.3)
    theirs.model.assemble(theirs.state)
    q = theirs.coordinates[0].getValue(theirs.state)
    coupled = skeleton.coordinates[1]
    assert skeleton.dofs == ("q",)
    assert coupled.coupled_to == "q"
    assert coupled.coupling(np.array([q]))[0] == pytest.approx(theirs.coordinates[1].getValue(theirs.state))


def _assert_same_pose(skeleton, theirs, q):
    R, p = body_poses(skeleton, q[None])
    theirs.mobility = list(range(len(q)))  # a tree of one branch, in order
    for k, coordinate in enumerate(theirs.coordinates):
        coordinate.setValue(theirs.state, q[k], False)
    theirs.model.realizePosition(theirs.state)
    for i, name in enumerate(skeleton.body_names):
        expected_R, expected_p = theirs.body(name)
        np.testing.assert_allclose(R[0, i], expected_R, atol=1e-12)
        np.testing.assert_allclose(p[0, i], expected_p, atol=1e-12)


@pytest.mark.parametrize(
    ("element", "expected"),
    [
        (line(2, 0.5), Linear(2.0, 0.5)),
        ("<SimmSpline><x>0 1 2</x><y>0 1 0</y></SimmSpline>", CubicSpline((0.0, 1.0, 2.0), (0.0, 1.0, 0.0))),
        ("<natCubicSpline><x>0 1</x><y>0 1</y></natCubicSpline>", CubicSpline((0.0, 1.0), (0.0, 1.0))),
        (
            "<function><NaturalCubicSpline><x>0 1</x><y>0 1</y></NaturalCubicSpline></function>",
            CubicSpline((0.0, 1.0), (0.0, 1.0)),
        ),
        (
            "<PiecewiseLinearFunction><x>0 1</x><y>0 1</y></PiecewiseLinearFunction>",
            PiecewiseLinear((0.0, 1.0), (0.0, 1.0)),
        ),
        (
            "<PolynomialFunction><coefficients>1 0 2</coefficients></PolynomialFunction>",
            Polynomial((1.0, 0.0, 2.0)),
        ),
        (
            f"<MultiplierFunction><function>{line(2, 1)}</function><scale>3</scale></MultiplierFunction>",
            Scaled(3.0, Linear(2.0, 1.0)),
        ),
    ],
)
def test_axis_functions(load, document4, element, expected):
    skeleton = load(document4(custom(axis("rotation1", "q", "0 0 1", element) + ACROSS)))
    assert [a.function for a in skeleton.joints[0].axes] == [expected]


def test_translations_come_before_rotations_and_constants_of_no_effect_are_dropped(load, document4):
    axes = (
        axis("rotation1", "q", "0 0 1", line(1, 0))
        + ACROSS
        + axis(
            "translation1",
            "",
            "1 0 0",
            "<MultiplierFunction><function><Constant><value>2</value></Constant></function><scale>0.5</scale></MultiplierFunction>",
        )
        + axis("translation2", "q", "0 1 0", line(0.1, 0))
    )
    kinds = [(a.kind, a.function) for a in load(document4(custom(axes))).joints[0].axes]
    assert kinds == [
        ("translation", Constant(1.0)),
        ("translation", Linear(0.1, 0.0)),
        ("rotation", Linear(1.0, 0.0)),
    ]


def test_a_coordinate_that_moves_nothing_is_locked_and_noted(load, document4):
    axes = axis("rotation1", "q", "0 0 1", line(1, 0)) + axis("rotation2", "idle", "1 0 0", STILL)
    skeleton = load(document4(custom(axes, '<Coordinate name="q"/><Coordinate name="idle"/>')))
    assert skeleton.dofs == ("q",)
    assert [c.locked for c in skeleton.coordinates] == [False, True]
    assert any("'idle' moves nothing" in note for note in skeleton.notes)


def test_defaults_stand_in_for_missing_properties(load, document4):
    defaults = (
        '<defaults><Marker name="default"><fixed>true</fixed></Marker>'
        '<Coordinate name="default"><range>-0.5 0.6</range></Coordinate></defaults>'
    )
    markers = (
        '<MarkerSet><objects><Marker name="M"><socket_parent_frame>/bodyset/a</socket_parent_frame>'
        "<location>0 1 0</location></Marker></objects></MarkerSet>"
    )
    skeleton = load(document4(PIN_A, rest=markers, head=defaults))
    assert skeleton.markers[0].fixed
    assert skeleton.coordinates[0].range == (-0.5, 0.6)


def test_markers_on_offset_frames_lie_on_their_body_and_those_on_the_ground_are_noted(load, document4):
    rest = (
        '<ComponentSet name="componentset"><objects><PhysicalOffsetFrame name="box"><socket_parent>/bodyset/a</socket_parent>'
        "<translation>0 1 0</translation><orientation>0 0 1.5707963267948966</orientation></PhysicalOffsetFrame></objects></ComponentSet>"
        '<MarkerSet name="markerset"><objects>'
        '<Marker name="M"><socket_parent_frame>../../componentset/box</socket_parent_frame><location>0.5 0 0</location></Marker>'
        '<Marker name="G"><socket_parent_frame>/ground</socket_parent_frame><location>0 0 0</location></Marker>'
        "</objects></MarkerSet>"
    )
    skeleton = load(document4(PIN_A, rest=rest))
    assert skeleton.marker_names == ("M",)
    np.testing.assert_allclose(skeleton.markers[0].position_body, [0, 1.5, 0], atol=1e-15)
    assert any("marker 'G'" in note for note in skeleton.notes)


def test_meshes_of_both_layouts_keep_scale_and_place(load, document3, document4):
    visible = (
        "<VisibleObject><GeometrySet><objects><DisplayGeometry><geometry_file>bone.vtp</geometry_file>"
        "<transform>0 0 0.5 0.1 0 0</transform><scale_factors>1 2 1</scale_factors></DisplayGeometry></objects>"
        "</GeometrySet><scale_factors>3 1 1</scale_factors><transform>0 0 0 0 1 0</transform></VisibleObject>"
    )
    joint = '<PinJoint name="j"><parent_body>ground</parent_body><CoordinateSet><objects><Coordinate name="q"/></objects></CoordinateSet></PinJoint>'
    mesh = load(document3(joint, body=visible)).bodies[0].geometry[0]
    assert mesh.file == "bone.vtp"
    np.testing.assert_allclose(mesh.scale, [3, 2, 1])
    np.testing.assert_allclose(mesh.p_body_mesh, [0.1, 1, 0])
    np.testing.assert_allclose(mesh.R_body_mesh, body_fixed_xyz(np.array([0, 0, 0.5])))

    attached = (
        '<components><PhysicalOffsetFrame name="g"><socket_parent>..</socket_parent><translation>0.1 1 0</translation>'
        "<orientation>0 0 0.5</orientation><attached_geometry><Mesh><socket_frame>..</socket_frame>"
        "<scale_factors>3 2 1</scale_factors><mesh_file>bone.vtp</mesh_file></Mesh></attached_geometry>"
        "</PhysicalOffsetFrame></components>"
    )
    text = document4(PIN_A).replace('<Body name="a">', f'<Body name="a">{attached}')
    again = load(text).bodies[0].geometry[0]
    np.testing.assert_allclose(again.scale, mesh.scale)
    np.testing.assert_allclose(again.p_body_mesh, mesh.p_body_mesh)
    np.testing.assert_allclose(again.R_body_mesh, mesh.R_body_mesh)


def test_locks_ranges_prescriptions_and_switched_off_couplings(load, document4):
    coordinate = (
        '<Coordinate name="q"><default_value>0.2</default_value><range>-Inf 1</range><clamped>true</clamped>'
        "<locked>TRUE</locked><prescribed>true</prescribed></Coordinate>"
    )
    coupler = (
        '<ConstraintSet><objects><CoordinateCouplerConstraint name="c"><isDisabled>true</isDisabled>'
        "</CoordinateCouplerConstraint></objects></ConstraintSet>"
    )
    skeleton = load(document4(PIN_A.replace('<Coordinate name="q"/>', coordinate), rest=coupler))
    q = skeleton.coordinates[0]
    assert (q.default, q.range, q.clamped, q.locked) == (0.2, (-np.inf, 1.0), True, True)
    assert any("prescribed" in note for note in skeleton.notes)
    assert any("switched off" in note for note in skeleton.notes)


# ---- what bad files are told ----------------------------------------------------------------------------

BOMB = '<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]><OpenSimDocument>&b;</OpenSimDocument>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BOMB, "entity definition"),
        ('<!DOCTYPE m SYSTEM "http://example.org/x.dtd"><OpenSimDocument/>', "entity definition"),
        ("this is no XML", "not well-formed"),
        ("", "not well-formed"),
        ('<?xml version="1.0" encoding="shift_jis"?><a/>', "cannot be decoded"),
        ("<html></html>", "root element is <html>"),
        ("<OpenSimDocument><Model/></OpenSimDocument>", "no numeric Version"),
        ('<OpenSimDocument Version="10000"><Model/></OpenSimDocument>', "older than OpenSim 2"),
        ('<OpenSimDocument Version="30516"><Model/></OpenSimDocument>', "trial version of OpenSim 4"),
        ('<OpenSimDocument Version="40000"/>', "no <Model>"),
        ('<OpenSimDocument Version="40000"><Model name="m"/></OpenSimDocument>', "no bodies"),
    ],
)
def test_files_that_are_no_models(load, text, message):
    _assert_one_clear_line(load, text, message)


def test_a_missing_file_and_a_folder_are_named(tmp_path):
    for path in (tmp_path / "none.osim", tmp_path):
        with pytest.raises(ModelError, match="cannot be read"):
            load_skeleton(path)


def test_a_truncated_file_says_where_it_ends(load, document4):
    text = document4(PIN_A)
    _assert_one_clear_line(load, text[: len(text) // 2], r"é\.osim:\d+: not well-formed XML")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<mass>1</mass>", "", r":5: Body 'a': <mass> is missing"),
        ("<mass>1</mass>", "<mass>nan</mass>", "finite"),
        ("<mass>1</mass>", "<mass>one</mass>", "'one' in <mass> is not a number"),
        ("<mass>1</mass>", "<mass>-2</mass>", "zero or positive"),
        ("<inertia>1 1 1 0 0 0", "<inertia>1 1 1", "holds 3 numbers; it needs 6"),
        ("<inertia>1 1 1 0 0 0", "<inertia>1 1 1 2 0 0", "negative principal moment"),
        ("/bodyset/a</socket_child", "/bodyset/z</socket_child", "'/bodyset/z', which the model does not have"),
        ('<PinJoint name="base"', '<PinJoint name=""', "has no name"),
        ('<Coordinate name="q"/>', '<Coordinate name="q"/><Coordinate name="p"/>', "has 2 coordinates; a PinJoint has 1"),
        ('<Coordinate name="q"/>', '<Coordinate name="q"><range>1 -1</range></Coordinate>', "runs backwards"),
        ('<Coordinate name="q"/>', '<Coordinate name="q"><locked>perhaps</locked></Coordinate>', "write true or false"),
    ],
)  # fmt: skip
def test_broken_elements_are_named_with_their_line(load, document4, old, new, message):
    text = document4(PIN_A)
    assert old in text
    _assert_one_clear_line(load, text.replace(old, new), message)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        ("<SineFunction/>", "SineFunction.*not supported"),
        ("<SimmSpline><x>0 1 1</x><y>0 1 2</y></SimmSpline>", "must increase"),
        ("<SimmSpline><x>0 1 2</x><y>0 1</y></SimmSpline>", "3 values in <x> and 2 in <y>"),
        ("<MultiplierFunction><scale>2</scale></MultiplierFunction>", "no function to multiply"),
        ("", "names coordinate 'q' but has no function"),
    ],
)
def test_functions_that_cannot_be_used(load, document4, function, message):
    _assert_one_clear_line(load, document4(custom(axis("rotation1", "q", "0 0 1", function))), message)


def test_functions_of_several_coordinates_are_refused_unless_one_drives_them(load, document4):
    two = '<Coordinate name="q"/><Coordinate name="r"/>'
    first = axis("rotation2", "r", "1 0 0", line(1, 0))
    trivial = load(document4(custom(axis("rotation1", "q r", "0 0 1", line(2, 0, 0.1)) + first, two)))
    assert (trivial.joints[0].axes[0].function, trivial.joints[0].axes[0].coordinate) == (
        Linear(2.0, 0.1),
        "q",
    )
    _assert_one_clear_line(
        load,
        document4(custom(axis("rotation1", "q r", "0 0 1", line(2, 1, 0.1)) + first, two)),
        r"several coordinates \(q, r\)",
    )


@pytest.mark.parametrize(
    ("joints", "rest", "message"),
    [
        (PIN_A, "", "no chain of joints leads from the ground to b"),
        (PIN_A + PIN_B + PIN_B.replace("elbow", "twin").replace('"r"', '"s"'), "", "'twin': it closes a loop"),
        (PIN_A + PIN_B.replace('"r"', '"q"'), "", "2 coordinates are called 'q'"),
        (PIN_A.replace("PinJoint", "EllipsoidJoint") + PIN_B, "", "EllipsoidJoint are not supported"),
        (PIN_A + PIN_B, '<ConstraintSet><objects><WeldConstraint name="w"/></objects></ConstraintSet>', "WeldConstraint 'w'.*not supported"),
        (PIN_A + PIN_B, '<JointSet file="joints.xml"/>', "lie in another file"),
        (PIN_A + PIN_B, '<ComponentSet><objects><Device name="d"><Body name="c"/></Device></objects></ComponentSet>', "inside of another component"),
        (PIN_A + PIN_B, f'<MarkerSet><objects>{2 * "<Marker name='M'><socket_parent_frame>/bodyset/a</socket_parent_frame></Marker>"}</objects></MarkerSet>', "names of their own"),
    ],
)  # fmt: skip
def test_trees_that_cannot_be_built(load, document4, joints, rest, message):
    _assert_one_clear_line(load, document4(joints, "a b", rest), message)


def test_a_reversed_joint_that_turns_and_slides_is_refused(load, document3):
    joint = (
        '<PlanarJoint name="j"><parent_body>ground</parent_body><CoordinateSet><objects><Coordinate name="t"/><Coordinate name="x"/>'
        '<Coordinate name="y"/></objects></CoordinateSet><reverse>true</reverse></PlanarJoint>'
    )
    _assert_one_clear_line(load, document3(joint), "is reversed .* and both turns and slides")


def test_couplings_in_a_circle_and_of_unknown_coordinates(load, document4):
    unknown = (
        '<ConstraintSet><objects><CoordinateCouplerConstraint name="c"><coupled_coordinates_function>'
        f"{line(1, 0)}</coupled_coordinates_function><independent_coordinate_names>nobody</independent_coordinate_names>"
        "<dependent_coordinate_name>q</dependent_coordinate_name></CoordinateCouplerConstraint></objects></ConstraintSet>"
    )
    _assert_one_clear_line(load, document4(PIN_A, rest=unknown), "couples 'nobody'")


def _assert_one_clear_line(load, text, message):
    with pytest.raises(ModelError, match=message) as caught:
        load(text)
    assert "\n" not in str(caught.value)
    assert "small model é.osim" in str(caught.value)
