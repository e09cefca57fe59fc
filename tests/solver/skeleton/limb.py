"""A leg as an OpenSim 4 model with one of each thing that scaling has to follow."""

import numpy as np

FACTORS = {"thigh": np.array([1.1, 0.9, 1.2]), "shank": np.array([0.95, 1.15, 1.05])}


def _point(name: str, frame: str, place: str, kind: str = "PathPoint", more: str = "") -> str:
    frame_tag = f"<socket_parent_frame>{frame}</socket_parent_frame>"
    return f'<{kind} name="{name}">{frame_tag}<location>{place}</location>{more}</{kind}>'


def _path(points: list[str], wrap: str = "") -> str:
    wraps = f'<PathWrap name="w"><wrap_object>{wrap}</wrap_object></PathWrap>' if wrap else ""
    return (
        f'<GeometryPath name="path"><PathPointSet><objects>{"".join(points)}</objects></PathPointSet>'
        f"<PathWrapSet><objects>{wraps}</objects></PathWrapSet></GeometryPath>"
    )


def _muscle(name: str, points: list[str], wrap: str = "") -> str:
    return (
        f'<Millard2012EquilibriumMuscle name="{name}"><!-- {name}, as it was cut -->{_path(points, wrap)}'
        "<max_isometric_force>500</max_isometric_force><optimal_fiber_length>0.1</optimal_fiber_length>"
        "<tendon_slack_length>0.2</tendon_slack_length></Millard2012EquilibriumMuscle>"
    )


def _body(name: str, inside: str) -> str:
    return (
        f'<Body name="{name}"><attached_geometry><Mesh name="m"><mesh_file>a.vtp</mesh_file></Mesh>'
        f"</attached_geometry>{inside}<mass>3</mass><mass_center>0 -0.2 0.01</mass_center>"
        "<inertia>0.05 0.01 0.06 0.001 0 0</inertia></Body>"
    )


def _wrap(kind: str, name: str, place: str, sizes: str, quadrant: str = "all") -> str:
    return (
        f'<{kind} name="{name}"><xyz_body_rotation>0.1 -0.2 0.3</xyz_body_rotation>'
        f"<translation>{place}</translation><quadrant>{quadrant}</quadrant>{sizes}</{kind}>"
    )


def _frame(name: str, parent: str, place: str, turn: str = "0 0 0") -> str:
    return (
        f'<PhysicalOffsetFrame name="{name}"><socket_parent>{parent}</socket_parent>'
        f"<translation>{place}</translation><orientation>{turn}</orientation></PhysicalOffsetFrame>"
    )


def _joint(kind: str, name: str, frames: str, coordinate: str, more: str = "") -> str:
    return (
        f'<{kind} name="{name}"><socket_parent_frame>near</socket_parent_frame><socket_child_frame>far'
        f'</socket_child_frame><coordinates><Coordinate name="{coordinate}"><default_value>0.4'
        f"</default_value><range>-2 2</range></Coordinate></coordinates><frames>{frames}</frames>{more}"
        f"</{kind}>"
    )


def _axis(name: str, direction: str, function: str, coordinate: str = "knee") -> str:
    return (
        f'<TransformAxis name="{name}"><coordinates>{coordinate}</coordinates><axis>{direction}</axis>'
        f"{function}</TransformAxis>"
    )


_LINE = '<LinearFunction name="function"><coefficients>1 0</coefficients></LinearFunction>'
_SLIDE = '<SimmSpline name="function"><x>-2 0 1 2</x><y>0.01 0 0.02 0.01</y></SimmSpline>'
_ELSEWHERE = '<Constant name="function"><value>-0.02</value></Constant>'
_TRANSFORM = (
    "<SpatialTransform>"
    + _axis("rotation3", "0 0 1", _LINE)
    + _axis("translation1", "1 0 0", _SLIDE)
    + _axis("translation2", "0 1 0", _ELSEWHERE, "")
    + "</SpatialTransform>"
)
_MOVING = "".join(
    f"<socket_{axis}_coordinate>/jointset/knee/knee</socket_{axis}_coordinate><{axis}_location>"
    f"<SimmSpline><x>-2 0 1 2</x><y>{ys}</y></SimmSpline></{axis}_location>"
    for axis, ys in (("x", "0.03 0.04 0.05 0.05"), ("y", "-0.02 0 0.01 0"), ("z", "0.01 0.01 0.02 0.02"))
)
_WHILE = "<socket_coordinate>/jointset/knee/knee</socket_coordinate><range>{}</range>"
THIGH, SHANK = "/bodyset/thigh", "/bodyset/shank"
ENDS = [_point("o", THIGH, "0.06 -0.1 0.01"), _point("i", SHANK, "0.05 -0.1 -0.02")]
BEHIND = [_point("o", THIGH, "-0.07 -0.25 0.02"), _point("i", THIGH, "0.08 -0.32 -0.01")]
_SOMETIMES = [
    ENDS[0],
    _point("on", SHANK, "0.06 0 0", "ConditionalPathPoint", _WHILE.format("0 1")),
    _point("off", SHANK, "0.2 0 0", "ConditionalPathPoint", _WHILE.format("1 2")),
    ENDS[1],
]
_KNEE = _frame("near", THIGH, "0 -0.4 0") + _frame("far", SHANK, "0 0 0")
_TILTED = "<components>" + _frame("tilted", "..", "0.02 -0.1 0.03", "0.2 0.1 -0.3") + "</components>"
_RING = "<inner_radius>0.01</inner_radius><outer_radius>0.05</outer_radius>"
_WRAPS = (
    '<WrapObjectSet name="wrapobjectset"><objects>'
    + _wrap("WrapCylinder", "pulley", "0.01 -0.39 0", "<radius>0.045</radius><length>0.3</length>", "x")
    + _wrap("WrapSphere", "ball", "0 -0.28 0", "<radius>0.04</radius>")
    + _wrap("WrapEllipsoid", "egg", "0 -0.28 0", "<dimensions>0.04 0.05 0.03</dimensions>")
    + _wrap("WrapTorus", "ring", "0 -0.28 0", _RING)
    + "</objects></WrapObjectSet>"
)

LIMB = f"""<?xml version="1.0" encoding="ISO-8859-1"?>
<!-- cut by José -->
<OpenSimDocument Version="40000">
	<Model name="limb_of_Zo\u00eb">
		<Ground name="ground"/>
		<BodySet name="bodyset"><objects>
{_body("thigh", _WRAPS + _TILTED)}
{_body("shank", "")}
		</objects></BodySet>
		<JointSet name="jointset"><objects>
{_joint("PinJoint", "hip", _frame("near", "/ground", "0 1 0") + _frame("far", THIGH, "0 0.01 0"), "hip")}
{_joint("CustomJoint", "knee", _KNEE, "knee", _TRANSFORM)}
		</objects></JointSet>
		<ForceSet name="forceset"><objects>
{_muscle("straight", ENDS)}
{_muscle("over_pulley", ENDS, "pulley")}
{_muscle("over_ball", BEHIND, "ball")}
{_muscle("over_egg", BEHIND, "egg")}
{_muscle("through_ring", BEHIND, "ring")}
{_muscle("by_frame", [_point("o", THIGH + "/tilted", "0.01 0.02 0.03"), ENDS[1]])}
{_muscle("moving", [ENDS[0], _point("m", SHANK, "0 0 0", "MovingPathPoint", _MOVING), ENDS[1]])}
{_muscle("sometimes", _SOMETIMES)}
			<PathSpring name="spring"><resting_length>0.3</resting_length><stiffness>9</stiffness>
			<dissipation>0</dissipation>{_path(ENDS)}</PathSpring>
			<Ligament name="ligament">{_path(ENDS)}<resting_length>0.25</resting_length></Ligament>
			<ExpressionBasedBushingForce name="bushing"><socket_frame1>one</socket_frame1><socket_frame2>other
			</socket_frame2><frames>{_frame("one", THIGH, "0 -0.4 0.01")}{_frame("other", SHANK, "0.01 0 0")}
			</frames></ExpressionBasedBushingForce>
		</objects></ForceSet>
		<ContactGeometrySet name="contactgeometryset"><objects><ContactSphere name="heel">
			<socket_frame>{SHANK}</socket_frame><location>-0.05 -0.4 0</location><radius>0.03</radius>
		</ContactSphere></objects></ContactGeometrySet>
		<MarkerSet name="markerset"><objects>
			<Marker name="KNEE"><socket_parent_frame>{THIGH}/tilted</socket_parent_frame>
				<location>0.01 -0.3 0.05</location></Marker>
			<Marker name="SPARE"><socket_parent_frame>{SHANK}</socket_parent_frame>
				<location>0 -0.1 0.1</location></Marker>
		</objects></MarkerSet>
	</Model>
</OpenSimDocument>
"""
