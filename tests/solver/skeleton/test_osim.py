"""Reading OpenSim models: what a construct means, and what a bad file is told."""

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.forward import body_poses
from solver.skeleton.functions import Constant, CubicSpline, Linear, PiecewiseLinear, Polynomial, Scaled
from solver.skeleton.osim import load_skeleton
from solver.skeleton.rotations import body_fixed_xyz

COORDINATES = {"WeldJoint": 0, "PinJoint": 1, "SliderJoint": 1, "UniversalJoint": 2}
COORDINATES |= {"BallJoint": 3, "GimbalJoint": 3, "FreeJoint": 6, "PlanarJoint": 3}


# ---- small documents ------------------------------------------------------------------------------------


def el(tag, *content, **attributes):
    """An XML element as text."""
    pairs = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f"<{tag}{pairs}>{''.join(map(str, content))}</{tag}>"


def objects(tag, *members):
    return el(tag, el("objects", *members), name=tag.lower())


def coordinates(*names):
    return "".join(el("Coordinate", name=name) for name in names)


def body(name, *content):
    inertia = el("inertia", "1 1 1 0 0 0")
    return el("Body", *content, el("mass", 1), el("mass_center", "0 0.1 0"), inertia, name=name)


def document4(joints, bodies="a", *rest, version=40000):
    """A model in the layout of OpenSim 4, one line an object."""
    parts = [
        el("Ground", name="ground"),
        objects("BodySet", *(body(name) + "\n" for name in bodies.split())),
        objects("JointSet", *(joint + "\n" for joint in joints)),
        *rest,
    ]
    return el("OpenSimDocument", "\n", el("Model", "\n".join(parts), name="small"), Version=version)


def document3(kind, *content, inside=""):
    """A model in the layout of OpenSim 3: body a on one joint to the ground."""
    joint = el(kind, el("parent_body", "ground"), *content, name="j")
    inertia = "".join(el(f"inertia_{axis}", 1) for axis in ("xx", "yy", "zz"))
    carried = el("Body", el("mass", 1), inertia, inside, el("Joint", joint), name="a")
    ground = el("Body", el("mass", 0), el("Joint"), name="ground")
    model = el("Model", el("BodySet", el("objects", ground, carried)), name="small")
    return el("OpenSimDocument", model, Version=30000)


def joint(kind, name, parent, child, *content, names=()):
    sockets = el("socket_parent_frame", parent) + el("socket_child_frame", child)
    return el(kind, sockets, el("coordinates", coordinates(*names)), *content, name=name)


def custom(*axes, names=("q",)):
    return joint("CustomJoint", "base", "/ground", "/bodyset/a", el("SpatialTransform", *axes), names=names)


def axis(name, driving, direction, function):
    return el("TransformAxis", el("coordinates", driving), el("axis", direction), function, name=name)


def line(*coefficients):
    return el("LinearFunction", el("coefficients", *(f"{c} " for c in coefficients)), name="function")


def constant(value):
    return el("Constant", el("value", value), name="function")


def knots(tag, x, y):
    return el(tag, el("x", x), el("y", y))


def multiple(factor, *inner):
    return el("MultiplierFunction", *(el("function", f) for f in inner), el("scale", factor))


def coupler(function, independent, dependent, factor=1.0):
    return objects(
        "ConstraintSet",
        el(
            "CoordinateCouplerConstraint",
            el("coupled_coordinates_function", function),
            el("independent_coordinate_names", independent),
            el("dependent_coordinate_name", dependent),
            el("scale_factor", factor),
            name="c",
        ),
    )


def marker(name, frame, location="0 1 0"):
    return el("Marker", el("socket_parent_frame", frame), el("location", location), name=name)


def offset_frame(name, parent, translation, orientation, *content):
    place = el("translation", translation) + el("orientation", orientation)
    return el("PhysicalOffsetFrame", el("socket_parent", parent), place, *content, name=name)


PIN_A = joint("PinJoint", "base", "/ground", "/bodyset/a", names=["q"])
PIN_B = joint("PinJoint", "elbow", "/bodyset/a", "/bodyset/b", names=["r"])
TURN = axis("rotation1", "q", "0 0 1", line(1, 0))
ACROSS = axis("rotation2", "", "1 0 0", constant(0)) + axis("rotation3", "", "0 1 0", constant(0))


@pytest.fixture
def load(tmp_path):
    def load(text):
        path = tmp_path / "a model é.osim"
        path.write_text(text, encoding="utf-8")
        return load_skeleton(path)

    return load


@pytest.fixture
def load_twice(load, referee, tmp_path):
    """By us, and by OpenSim."""

    def load_twice(text):
        skeleton = load(text)
        return skeleton, referee(tmp_path / "a model é.osim", skeleton)

    return load_twice


# ---- what constructs mean, according to OpenSim ---------------------------------------------------------


@pytest.mark.opensim
@pytest.mark.parametrize("kind", COORDINATES)
def test_standard_joints_between_chained_frames_move_as_in_opensim(kind, load_twice):
    place = ("0.1 -0.2 0.3", "0.4 0.5 -0.6")
    frames = el(
        "frames",
        offset_frame("near", "/ground", *place),
        offset_frame("far", "../../../bodyset/a", *place),
        offset_frame("next", "../near", *place),
    )
    names = [f"q{i}" for i in range(COORDINATES[kind])]
    _assert_same_pose(*load_twice(document4([joint(kind, "j", "next", "far", frames, names=names)])))


@pytest.mark.opensim
@pytest.mark.parametrize(
    ("kind", "reverse"),
    [(kind, "false") for kind in COORDINATES]
    + [(kind, "true") for kind in COORDINATES if kind not in ("FreeJoint", "PlanarJoint")],
)
def test_joints_of_old_documents_move_as_in_opensim(kind, reverse, load_twice):
    names = coordinates(*(f"q{i}" for i in range(COORDINATES[kind])))
    content = (
        el("location_in_parent", "0.1 0.2 0.3"),
        el("orientation_in_parent", "0.4 0.5 -0.6"),
        el("location", "-0.3 0.2 0"),
        el("orientation", "0 0.123456789 0"),  # OpenSim's conversion keeps six digits
        el("CoordinateSet", el("objects", names)),
        el("reverse", reverse),
    )
    _assert_same_pose(*load_twice(document3(kind, *content)))


@pytest.mark.opensim
def test_coordinates_follow_the_joints_and_the_axes_not_their_list(load_twice):
    """OpenSim orders by JointSet, then by first use in the SpatialTransform."""
    axes = (
        axis("rotation1", "turn", "0 0 1", line(1, 0)),
        axis("rotation2", "bow", "1 0 0", line(-1, 0.1)),
        axis("rotation3", "", "0 1 0", constant(0)),
        axis("translation1", "slide", "2 1 0", line(2, 0.5)),
        axis("translation2", "", "0 1 0", constant(0)),
        axis("translation3", "", "0 0 1", constant(0.3)),
    )
    base = custom(*axes, names=("slide", "bow", "turn"))
    skeleton, theirs = load_twice(document4([PIN_B, base], "b a"))
    assert [c.name for c in skeleton.coordinates] == [c.getName() for c in theirs.coordinates]
    assert [c.name for c in skeleton.coordinates] == ["r", "turn", "bow", "slide"]
    assert [c.motion for c in skeleton.coordinates] == ["rotation", "rotation", "rotation", "coupled"]
    assert skeleton.body_names == ("a", "b")
    _assert_same_pose(skeleton, theirs)


@pytest.mark.opensim
def test_a_coupler_scales_its_function(load_twice):
    skeleton, theirs = load_twice(document4([PIN_A, PIN_B], "a b", coupler(line(3, 0.1), "q", "r", 2.0)))
    theirs.coordinates[0].setValue(theirs.state, 0.3)
    theirs.model.assemble(theirs.state)
    q, r = (c.getValue(theirs.state) for c in theirs.coordinates)
    assert skeleton.dofs == ("q",)
    assert skeleton.coordinates[1].coupling(np.array([q]))[0] == pytest.approx(r, abs=1e-9)


def _assert_same_pose(skeleton, theirs):
    q = np.linspace(0.2, 0.9, len(skeleton.dofs))
    for value, coordinate in zip(q, theirs.coordinates, strict=True):
        coordinate.setValue(theirs.state, value, False)
    theirs.model.realizePosition(theirs.state)
    R, p = body_poses(skeleton, q[None])
    for i, name in enumerate(skeleton.body_names):
        expected_R, expected_p = theirs.body(name)
        np.testing.assert_allclose(R[0, i], expected_R, atol=1e-12)
        np.testing.assert_allclose(p[0, i], expected_p, atol=1e-12)


# ---- what constructs mean -------------------------------------------------------------------------------

BEND = CubicSpline((0.0, 1.0, 2.0), (0.0, 1.0, 0.0))


@pytest.mark.parametrize(
    ("element", "expected"),
    [
        (line(2, 0.5), Linear(2.0, 0.5)),
        (knots("SimmSpline", "0 1 2", "0 1 0"), BEND),
        (knots("natCubicSpline", "0 1 2", "0 1 0"), BEND),
        (el("function", knots("NaturalCubicSpline", "0 1 2", "0 1 0")), BEND),
        (knots("PiecewiseLinearFunction", "0 1", "0 2"), PiecewiseLinear((0.0, 1.0), (0.0, 2.0))),
        (el("PolynomialFunction", el("coefficients", "1 0 2")), Polynomial((1.0, 0.0, 2.0))),
        (multiple(3, line(2, 1)), Scaled(3.0, Linear(2.0, 1.0))),
    ],
)
def test_axis_functions(load, element, expected):
    skeleton = load(document4([custom(axis("rotation1", "q", "0 0 1", element), ACROSS)]))
    assert [a.function for a in skeleton.joints[0].axes] == [expected]


def test_translations_come_first_and_axes_that_do_nothing_are_dropped(load):
    still = axis("translation1", "", "1 0 0", multiple(0.5, constant(2)))
    slide = axis("translation2", "q", "0 1 0", line(0.1, 0))
    axes = load(document4([custom(TURN, ACROSS, still, slide)])).joints[0].axes
    assert [a.kind for a in axes] == ["translation", "translation", "rotation"]
    assert [a.function for a in axes] == [Constant(1.0), Linear(0.1, 0.0), Linear(1.0, 0.0)]


def test_a_coordinate_that_moves_nothing_is_locked_and_noted(load):
    idle = axis("rotation2", "idle", "1 0 0", constant(0))
    skeleton = load(document4([custom(TURN, idle, names=("q", "idle"))]))
    assert skeleton.dofs == ("q",)
    assert any("'idle' moves nothing" in note for note in skeleton.notes)


def test_defaults_stand_in_for_missing_properties(load):
    defaults = el(
        "defaults",
        el("Marker", el("fixed", "true"), name="default"),
        el("Coordinate", el("range", "-0.5 0.6"), name="default"),
    )
    markers = objects("MarkerSet", marker("M", "/bodyset/a"))
    skeleton = load(document4([PIN_A], "a", defaults, markers))
    assert skeleton.markers[0].fixed
    assert skeleton.coordinates[0].range == (-0.5, 0.6)


def test_markers_follow_offset_frames_and_those_on_the_ground_are_noted(load):
    frame = offset_frame("box", "/bodyset/a", "0 1 0", f"0 0 {np.pi / 2}")
    markers = marker("M", "../../componentset/box", "0.5 0 0"), marker("G", "/ground")
    skeleton = load(document4([PIN_A], "a", objects("ComponentSet", frame), objects("MarkerSet", *markers)))
    assert skeleton.marker_names == ("M",)
    np.testing.assert_allclose(skeleton.markers[0].position_body, [0, 1.5, 0], atol=1e-15)
    assert any("marker 'G'" in note for note in skeleton.notes)


def test_meshes_of_both_layouts_keep_their_scale_and_place(load):
    shown = el(
        "DisplayGeometry",
        el("geometry_file", "bone.vtp"),
        el("transform", "0 0 0.5 0.1 0 0"),
        el("scale_factors", "1 2 1"),
    )
    outer = el("scale_factors", "3 1 1") + el("transform", "0 0 0 0 1 0")
    visible = el("VisibleObject", el("GeometrySet", el("objects", shown)), outer)
    pin = el("CoordinateSet", el("objects", coordinates("q")))
    old = load(document3("PinJoint", pin, inside=visible)).bodies[0].geometry[0]

    mesh = el("Mesh", el("socket_frame", ".."), el("scale_factors", "3 2 1"), el("mesh_file", "bone.vtp"))
    frame = offset_frame("g", "..", "0.1 1 0", "0 0 0.5", el("attached_geometry", mesh))
    text = document4([PIN_A]).replace(body("a"), body("a", el("components", frame)))
    for geometry in (old, load(text).bodies[0].geometry[0]):
        assert geometry.file == "bone.vtp"
        np.testing.assert_allclose(geometry.scale, [3, 2, 1])
        np.testing.assert_allclose(geometry.p_body_mesh, [0.1, 1, 0])
        np.testing.assert_allclose(geometry.R_body_mesh, body_fixed_xyz(np.array([0, 0, 0.5])))


def test_locks_ranges_prescriptions_and_switched_off_couplings(load):
    settings = el("default_value", 0.2) + el("range", "-Inf 1") + el("clamped", "true")
    settings += el("locked", "TRUE") + el("prescribed", "true")
    pin = PIN_A.replace(coordinates("q"), el("Coordinate", settings, name="q"))
    off = objects("ConstraintSet", el("CoordinateCouplerConstraint", el("isEnforced", "false"), name="c"))
    skeleton = load(document4([pin], "a", off))
    q = skeleton.coordinates[0]
    assert (q.default, q.range, q.clamped, q.locked) == (0.2, (-np.inf, 1.0), True, True)
    assert any("prescribed" in note for note in skeleton.notes)
    assert any("switched off" in note for note in skeleton.notes)


# ---- what bad files are told ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("40000", "30516", "trial version of OpenSim 4"),
        ("<mass>1</mass>", "", r":3: Body 'a': <mass> is missing"),
        ("<mass>1</mass>", "<mass>nan</mass>", "finite"),
        ("<mass>1</mass>", "<mass>one</mass>", "'one' in <mass> is not a number"),
        ("<mass>1</mass>", "<mass>-2</mass>", "zero or positive"),
        ("1 1 1 0 0 0", "1 1 1", "holds 3 numbers; it needs 6"),
        ("1 1 1 0 0 0", "1 1 1 2 0 0", "negative principal moment"),
        ("/bodyset/a</socket_child", "/z</socket_child", "'/z', which the model does not have"),
        (' name="base"', "", "has no name"),
        (coordinates("q"), coordinates("q", "p"), "has 2 coordinates; a PinJoint has 1"),
        (coordinates("q"), el("Coordinate", el("range", "1 -1"), name="q"), "runs backwards"),
        (coordinates("q"), el("Coordinate", el("locked", "perhaps"), name="q"), "write true or false"),
        ("PinJoint", "EllipsoidJoint", "EllipsoidJoint 'base': joints of type .* not supported"),
    ],
)
def test_broken_elements_are_named(load, old, new, message):
    text = document4([PIN_A])
    assert old in text
    _assert_one_clear_line(load, text.replace(old, new), message)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (el("SineFunction"), "SineFunction.*not supported"),
        (knots("SimmSpline", "0 1 1", "0 1 2"), "must increase"),
        (knots("SimmSpline", "0 1 2", "0 1"), "3 values in <x> and 2 in <y>"),
        (multiple(2), "no function to multiply"),
        ("", "names coordinate 'q' but has no function"),
    ],
)
def test_functions_that_cannot_be_used(load, function, message):
    _assert_one_clear_line(load, document4([custom(axis("rotation1", "q", "0 0 1", function))]), message)


def test_functions_of_several_coordinates_are_refused_unless_one_drives_them(load):
    bow = axis("rotation2", "r", "1 0 0", line(1, 0))

    def document(*slopes):
        both = axis("rotation1", "q r", "0 0 1", line(*slopes, 0.1))
        return document4([custom(both, bow, names=("q", "r"))])

    driven = load(document(2, 0)).joints[0].axes[0]
    assert (driven.function, driven.coordinate) == (Linear(2.0, 0.1), "q")
    _assert_one_clear_line(load, document(2, 1), r"several coordinates \(q, r\)")


TWIN = joint("PinJoint", "counterpart", "/bodyset/a", "/bodyset/b", names=["s"])
DEVICE = objects("ComponentSet", el("Device", body("c"), name="d"))


@pytest.mark.parametrize(
    ("joints", "rest", "message"),
    [
        ([PIN_A], "", "no chain of joints leads from the ground to b"),
        ([PIN_A, PIN_B, TWIN], "", "'counterpart': it closes a loop"),
        ([PIN_A, PIN_B.replace('"r"', '"q"')], "", "2 coordinates are called 'q'"),
        ([PIN_A, PIN_B], objects("ConstraintSet", el("WeldConstraint", name="w")), "WeldConstraint 'w'"),
        ([PIN_A, PIN_B], el("JointSet", file="joints.xml"), "lie in another file"),
        ([PIN_A, PIN_B], DEVICE, "inside of another component"),
        ([PIN_A, PIN_B], objects("MarkerSet", 2 * marker("M", "/bodyset/a")), "names of their own"),
        ([PIN_A, PIN_B], coupler(line(1, 0), "nobody", "q"), "couples 'nobody'"),
    ],
)
def test_models_that_cannot_be_built(load, joints, rest, message):
    _assert_one_clear_line(load, document4(joints, "a b", rest), message)


def test_a_reversed_joint_that_turns_and_slides_is_refused(load):
    three = el("CoordinateSet", el("objects", coordinates("t", "x", "y")))
    text = document3("PlanarJoint", three, el("reverse", "true"))
    _assert_one_clear_line(load, text, "is reversed .* and both turns and slides")


def _assert_one_clear_line(load, text, message):
    with pytest.raises(ModelError, match=message) as caught:
        load(text)
    assert "\n" not in str(caught.value)
    assert "a model é.osim" in str(caught.value)
