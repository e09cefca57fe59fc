"""The default full body: 22 bodies and 37 degrees of freedom, built from published tables.

Bodies, joints and coordinates carry OpenSim's usual names and signs, and body frames lie where OpenSim's do
(x forward, y up, z right; pelvis between the anterior spines, femur at the hip, tibia at the knee, calcn at
the heel, torso at the lumbar joint), so that bone meshes drawn for OpenSim fit. The numbers are those of
`solver.skeleton.segment_tables`; its left side is the mirror image of the right.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.skeleton.default_frames import BodyFrames, body_frames
from solver.skeleton.default_markers import default_markers
from solver.skeleton.functions import CubicSpline, Linear, ScalarFunction
from solver.skeleton.rotations import rotation_about, skew
from solver.skeleton.segment_tables import (
    ANKLE_AXIS,
    BALL_ALONG_FOOT,
    KNEE_ROLL_BACK_AT_120_DEG,
    METATARSAL_BREAK_AXIS,
    PATELLA_FLEXION_RATIO,
    RANGES_DEG,
    SUBTALAR_AXIS,
    Lengths,
    SegmentShape,
    Sex,
    lengths,
    segment_shape,
)
from solver.skeleton.skeleton import Axis, Body, Coordinate, Geometry, Joint, Skeleton

X, Y, Z = np.eye(3)
_SAME = Linear(1.0, 0.0)
_PELVIS_REACH_M = 100.0  # a walkway's length: translations have no anatomical range
_FILES = {
    "pelvis": ("r_pelvis", "l_pelvis", "sacrum"),
    "femur": ("{s}_femur",),
    "tibia": ("{s}_tibia", "{s}_fibula"),
    "patella": ("{s}_patella",),
    "talus": ("{s}_talus",),
    "calcn": ("{s}_foot",),
    "toes": ("{s}_bofoot",),
    "torso": ("hat_spine", "hat_jaw", "hat_skull", "hat_ribs_scap"),
    "humerus": ("humerus_{s}v",),
    "ulna": ("ulna_{s}v",),
    "radius": ("radius_{s}v",),
    "hand": tuple(
        f"{bone}_{{s}}vs"
        for bone in (
            *("pisiform", "lunate", "scaphoid", "triquetrum", "hamate", "capitate", "trapezoid", "trapezium"),
            *("metacarpal1", "thumb_proximal", "thumb_distal"),
            *(
                f"{part.format(finger)}"
                for number, finger in enumerate(("index", "middle", "ring", "little"), start=2)
                for part in (f"metacarpal{number}", "{}_proximal", "{}_medial", "{}_distal")
            ),
        )
    ),
}
# A foot whose height falls evenly from the heel to 0.3 of it at the toes holds this share before the ball;
# its centroid then lies at 41 % of the length, between de Leva's 40 % (women) and 44 % (men).
_TIP = 0.3
TOES_SHARE = 1 - (BALL_ALONG_FOOT - (1 - _TIP) * BALL_ALONG_FOOT**2 / 2) / (1 - (1 - _TIP) / 2)
TALUS_SHARE = 0.1  # of the foot: the bone and what surrounds it; no table cuts the foot here
PATELLA_SHARE = 0.001  # of body mass, out of the thigh: the bone and its tendon


def default_skeleton(*, mass_kg: float = 70.0, height_m: float = 1.72, sex: str | None = None) -> Skeleton:
    """A person of this mass and stature, upright with the soles on the ground in the default pose.

    Args:
        mass_kg: body mass [kg].
        height_m: stature [m].
        sex: whose tables to take; None takes the mean of both.

    Raises:
        ModelError: mass or height cannot be a person's, or the sex is neither "male", "female" nor None.
    """
    if not (2 <= mass_kg <= 400 and 0.5 <= height_m <= 2.6):
        raise ModelError(
            f"No person has a mass of {mass_kg:g} kg and a height of {height_m:g} m; check the units."
        )
    if sex not in (None, "male", "female"):
        raise ModelError(f"sex = {sex!r}: the tables know 'male', 'female' or None (the mean of both).")
    table = cast(Sex | None, sex)
    of = lengths(height_m, table)
    frames = body_frames(of)
    assembly = _Assembly(mass_elements(of, frames, mass_kg, table), DefaultBones(of, frames))
    assembly.add_pelvis(height=of.hip_height - frames.hip_pelvis[1])
    for side in "rl":
        assembly.add_leg(side, frames, of)
    assembly.add_torso(frames)
    for side in "rl":
        assembly.add_arm(side, frames, of)
    skeleton = Skeleton(
        name=f"default body, {mass_kg:g} kg, {height_m:g} m",
        bodies=tuple(assembly.bodies),
        joints=tuple(assembly.joints),
        coordinates=tuple(assembly.coordinates),
        markers=(),
    )
    return skeleton.with_markers(default_markers(skeleton, of, frames))


@dataclass(frozen=True)
class _Hinge:
    """A right-hand or central joint."""

    name: str
    parent: str | None
    centre_parent: Float[np.ndarray, "3"]  # [m]
    axes: tuple[Axis, ...]
    centre_child: Float[np.ndarray, "3"] = field(
        default_factory=lambda: np.zeros(3)
    )  # [m] in the body carried


@dataclass(frozen=True)
class DefaultBones:
    """Meshes of one person. The meshes' own sizes are those of the skeleton they were drawn from."""

    lengths: Lengths
    frames: BodyFrames

    def of(self, kind: str, side: str) -> tuple[Geometry, ...]:
        """Meshes of a body, in its own frame; side is "r", "l" or ""."""
        scale = self._scale(kind)
        return tuple(
            Geometry(f"{file.format(s=side)}.vtp", scale, np.eye(3), np.zeros(3)) for file in _FILES[kind]
        )

    def _scale(self, kind: str) -> Float[np.ndarray, "3"]:
        of, frames = self.lengths, self.frames
        if kind == "pelvis":  # hip sockets 5.6 cm behind, 7.8 cm below the spines and 7.7 cm from the midline
            return np.abs(frames.hip_pelvis) / (0.056, 0.078, 0.077)
        if (
            kind == "torso"
        ):  # shoulder sockets 37 cm above and 17 cm beside the lumbar joint, the vertex 65 cm
            vertex = frames.hip_pelvis[1] + of.c7_above_hips + of.head - frames.torso_pelvis[1]
            up = (frames.shoulder_torso[1] / 0.37 + vertex / 0.65) / 2
            return np.array([up, up, of.shoulder_half_width / 0.17])
        if kind in (
            "talus",
            "calcn",
            "toes",
        ):  # from heel to ball 17.9 cm, from ankle down to the heel 4.2 cm
            along = frames.toes_calcn[0] / 0.179
            return np.array([along, -frames.calcn_talus[1] / 0.042, along])
        length = {  # hip to knee, knee to ankle, shoulder to elbow, elbow to wrist [m]
            "femur": of.thigh / 0.404,
            "patella": of.thigh / 0.404,
            "tibia": of.shank / 0.400,
            "humerus": of.upper_arm / 0.287,
            "ulna": of.forearm / 0.262,
            "radius": of.forearm / 0.262,
            "hand": of.hand / 0.086,
        }[kind]
        return np.full(3, length)


@dataclass(frozen=True)
class MassElement:
    """A rigid part in the frame of one body. Inertia is about the centre of mass."""

    mass: float  # [kg]
    com: Float[np.ndarray, "3"]  # [m]
    inertia: Float[np.ndarray, "3 3"]  # [kg·m²]

    def inertia_about(self, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
        """Inertia about another point (Huygens-Steiner) [kg·m²]."""
        offset = skew(self.com - point)
        return self.inertia - self.mass * offset @ offset

    def moved(self, by: Float[np.ndarray, "3"]) -> "MassElement":
        """The same part elsewhere."""
        return replace(self, com=self.com + by)


@dataclass
class _Assembly:
    """Bodies, joints and coordinates as they are added; sides mirror in the plane z = 0."""

    elements: dict[str, MassElement]
    bones: DefaultBones
    bodies: list[Body] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    coordinates: list[Coordinate] = field(default_factory=list)

    def add_pelvis(self, height: float) -> None:
        self._add("pelvis", "", _Hinge("ground_pelvis", None, np.zeros(3), _floating_axes()))
        turn, reach = np.pi, _PELVIS_REACH_M
        for name in ("pelvis_tilt", "pelvis_list", "pelvis_rotation"):
            self.coordinates.append(Coordinate(name, "rotation", 0.0, (-turn, turn)))
        for name, default in (("pelvis_tx", 0.0), ("pelvis_ty", height), ("pelvis_tz", 0.0)):
            self.coordinates.append(Coordinate(name, "translation", default, (-reach, reach)))

    def add_leg(self, side: str, frames: BodyFrames, of: Lengths) -> None:
        hip = (("hip_flexion", Z), ("hip_adduction", X), ("hip_rotation", Y))
        self._add("femur", side, _Hinge("hip", "pelvis", frames.hip_pelvis, self._rotations(side, hip)))
        knee = (*_knee_translations(f"knee_angle_{side}", of), *self._rotations(side, (("knee_angle", -Z),)))
        self._add("tibia", side, _Hinge("walker_knee", "femur", frames.knee_femur, knee))
        self._add_patella(side, frames)
        ankle = self._rotations(side, (("ankle_angle", ANKLE_AXIS),))
        self._add("talus", side, _Hinge("ankle", "tibia", frames.ankle_tibia, ankle))
        subtalar = self._rotations(side, (("subtalar_angle", SUBTALAR_AXIS),))
        self._add("calcn", side, _Hinge("subtalar", "talus", np.zeros(3), subtalar, -frames.calcn_talus))
        toes = self._rotations(side, (("mtp_angle", METATARSAL_BREAK_AXIS),))
        self._add("toes", side, _Hinge("mtp", "calcn", frames.toes_calcn, toes))

    def add_torso(self, frames: BodyFrames) -> None:
        back = (("lumbar_extension", Z), ("lumbar_bending", X), ("lumbar_rotation", Y))
        self._add("torso", "", _Hinge("back", "pelvis", frames.torso_pelvis, self._rotations("", back)))

    def add_arm(self, side: str, frames: BodyFrames, of: Lengths) -> None:
        shoulder = (("arm_flex", Z), ("arm_add", X), ("arm_rot", Y))
        upper_arm = self._rotations(side, shoulder)
        self._add("humerus", side, _Hinge("acromial", "torso", frames.shoulder_torso, upper_arm))
        # the axis halves the carrying angle, so that the flexed forearm lies over the upper arm
        half = of.carrying_angle / 2
        elbow = self._rotations(side, (("elbow_flex", np.array([0.0, np.sin(half), np.cos(half)])),))
        self._add("ulna", side, _Hinge("elbow", "humerus", frames.elbow_humerus, elbow))
        ulnar_head = frames.wrist_ulna - np.array([0.0, 0.0, 0.07 * of.forearm])
        forearm = self._rotations(side, (("pro_sup", frames.radius_ulna - ulnar_head),))
        self._add("radius", side, _Hinge("radioulnar", "ulna", frames.radius_ulna, forearm))
        wrist = self._rotations(side, (("wrist_flex", Z), ("wrist_dev", X)))
        self._add("hand", side, _Hinge("radius_hand", "radius", frames.wrist_radius, wrist))

    def _add_patella(self, side: str, frames: BodyFrames) -> None:
        """The patella circles the knee's centre in the femur, a fixed share of the knee's flexion."""
        knee, beta = f"knee_angle_{side}", f"knee_angle_{side}_beta"
        low, high = np.radians(RANGES_DEG["knee_angle"]) * PATELLA_FLEXION_RATIO
        self.coordinates.append(
            Coordinate(
                beta,
                "coupled",
                0.0,
                (low, high),
                coupling=Linear(PATELLA_FLEXION_RATIO, 0.0),
                coupled_to=knee,
            )
        )
        axes = (Axis("rotation", -Z, _SAME, beta),)
        below_pole = frames.knee_femur - frames.patella_femur
        hinge = _Hinge("patellofemoral", "femur", frames.knee_femur, axes, below_pole)
        self._add("patella", side, hinge)

    def _rotations(self, side: str, turns: Sequence[tuple[str, Float[np.ndarray, "3"]]]) -> tuple[Axis, ...]:
        """One axis a coordinate, and the coordinates themselves. Axial vectors mirror to (−x, −y, z)."""
        axes = []
        for stem, axis in turns:
            name = f"{stem}_{side}" if side else stem
            low, high = np.radians(RANGES_DEG[stem])
            self.coordinates.append(Coordinate(name, "rotation", 0.0, (float(low), float(high))))
            mirrored = axis * (-1, -1, 1) if side == "l" else axis
            axes.append(Axis("rotation", mirrored / np.linalg.norm(axis), _SAME, name))
        return tuple(axes)

    def _add(self, kind: str, side: str, hinge: "_Hinge") -> None:
        """A body on its joint, mirrored for the left side."""
        mirror = np.array([1.0, 1.0, -1.0]) if side == "l" else np.ones(3)
        suffix = f"_{side}" if side else ""
        names = [body.name for body in self.bodies]
        parents = (f"{hinge.parent}{suffix}", hinge.parent)
        parent = next((names.index(name) for name in parents if name in names), -1)
        self.joints.append(
            Joint(
                name=f"{hinge.name}{suffix}",
                parent=parent,
                R_parent_frame=np.eye(3),
                p_parent_frame=mirror * hinge.centre_parent,
                R_child_frame=np.eye(3),
                p_child_frame=mirror * hinge.centre_child,
                axes=hinge.axes,
            )
        )
        element = self.elements[kind]
        self.bodies.append(
            Body(
                name=f"{kind}{suffix}",
                mass=element.mass,
                com_body=mirror * element.com,
                inertia_body=mirror[:, None] * element.inertia * mirror,
                geometry=self.bones.of(kind, side),
            )
        )


def _floating_axes() -> tuple[Axis, ...]:
    translations = [
        Axis("translation", axis, _SAME, f"pelvis_t{name}") for axis, name in ((X, "x"), (Y, "y"), (Z, "z"))
    ]
    turns = ((Z, "pelvis_tilt"), (X, "pelvis_list"), (Y, "pelvis_rotation"))
    return (*translations, *(Axis("rotation", axis, _SAME, name) for axis, name in turns))


def _knee_translations(knee: str, of: Lengths) -> tuple[Axis, ...]:
    """Rolling and gliding: the condyles roll back on the tibia by d(θ) = D (1 − cos θ)/2.

    The flexion centre is fixed in the femur, so the tibia's origin moves to R(θ) (d, 0, 0) from it.
    """
    full = KNEE_ROLL_BACK_AT_120_DEG * of.stature / ((1 - np.cos(np.radians(120))) / 2)
    angle = np.radians(np.arange(-20.0, 161.0, 10.0))
    roll_back = full * (1 - np.cos(angle)) / 2

    def through(values: Float[np.ndarray, " knots"]) -> ScalarFunction:
        return CubicSpline(tuple(angle.tolist()), tuple(values.tolist()))

    return (
        Axis("translation", X, through(roll_back * np.cos(angle)), knee),
        Axis("translation", Y, through(-roll_back * np.sin(angle)), knee),
    )


def segment_element(
    shape: SegmentShape, body_mass: float, start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]
) -> MassElement:
    """A segment of the tables laid between its end points.

    Its long axis is y, turned to the line between the points by the least rotation.

    Args:
        shape: a row of the table.
        body_mass: of the whole person [kg].
        start: the end point that the centre of mass counts from [m].
        end: the other [m].
    """
    along = end - start
    length = float(np.linalg.norm(along))
    mass = shape.mass * body_mass
    radii = length * np.array([shape.radius_sagittal, shape.radius_longitudinal, shape.radius_transverse])
    R = _least_rotation(np.array([0.0, np.sign(along[1]), 0.0]), along / length)
    return MassElement(mass, start + shape.com * along, R @ np.diag(mass * radii**2) @ R.T)


def ellipsoid(mass: float, com: Float[np.ndarray, "3"], half_axes: Float[np.ndarray, "3"]) -> MassElement:
    """A solid ellipsoid along the body's axes."""
    squares = half_axes**2
    return MassElement(mass, com, np.diag(mass / 5 * (squares.sum() - squares)))


def box(mass: float, com: Float[np.ndarray, "3"], edges: Float[np.ndarray, "3"]) -> MassElement:
    """A solid cuboid along the body's axes."""
    squares = edges**2
    return MassElement(mass, com, np.diag(mass / 12 * (squares.sum() - squares)))


def together(parts: Sequence[MassElement]) -> MassElement:
    """Rigidly joined parts as one."""
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / mass
    return MassElement(mass, com, sum((part.inertia_about(com) for part in parts), np.zeros((3, 3))))


def without(whole: MassElement, parts: Sequence[MassElement]) -> MassElement:
    """What is left of a whole when parts of it become bodies of their own."""
    return together([whole, *(MassElement(-part.mass, part.com, -part.inertia) for part in parts)])


def _least_rotation(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation by the least angle that takes unit vector a to unit vector b."""
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3)
    return rotation_about(axis / sine, np.array([np.arctan2(sine, a @ b)]))[0]


def mass_elements(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    """One element for each central or right-hand body, in its frame; left ones are the mirror image.

    Args:
        of: lengths of the person.
        frames: of the same person.
        mass: of the whole person [kg].
        sex: whose tables to take.
    """
    return {
        **_trunk(of, frames, mass, sex),
        **_leg(of, frames, mass, sex),
        **_foot(of, frames, mass, sex),
        **_arm(of, frames, mass, sex),
    }


def _trunk(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    middle, upper = of.trunk_above_navel
    navel = of.navel_above_hips
    ends = {
        "lower_trunk": (navel, 0.0),
        "middle_trunk": (navel + middle, navel),
        "upper_trunk": (navel + middle + upper, navel + middle),
        "head": (of.c7_above_hips + of.head, of.c7_above_hips),
    }
    parts = {
        name: segment_element(
            segment_shape(name, sex), mass, frames.trunk_line(top), frames.trunk_line(bottom)
        )
        for name, (top, bottom) in ends.items()
    }
    above = [parts[name].moved(-frames.torso_pelvis) for name in ("middle_trunk", "upper_trunk", "head")]
    return {"pelvis": parts["lower_trunk"], "torso": together(above)}


def _leg(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    hip = np.zeros(3)
    thigh = segment_element(segment_shape("thigh", sex), mass, hip, frames.knee_femur)
    half_axes = np.array([0.006, 0.013, 0.013]) * of.stature  # a bone of 4.5 cm, 2 cm thick
    patella = ellipsoid(PATELLA_SHARE * mass, np.array([0.0, half_axes[1], 0.0]), half_axes)
    return {
        "femur": without(thigh, [patella.moved(frames.patella_femur)]),
        "patella": patella,
        "tibia": segment_element(segment_shape("shank", sex), mass, np.zeros(3), frames.ankle_tibia),
    }


def _foot(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    shape = segment_shape("foot", sex)
    total = shape.mass * mass
    height = 0.5 * of.ankle_height - frames.calcn_above_sole
    com = np.array([shape.com * of.foot - frames.heel_behind_calcn, height, 0.0])
    # along a foot the tables' longitudinal axis is x and their sagittal axis (across the segment) is z
    radii = of.foot * np.array([shape.radius_longitudinal, shape.radius_transverse, shape.radius_sagittal])
    foot = MassElement(total, com, np.diag(total * radii**2))

    toe_length = (1 - BALL_ALONG_FOOT) * of.foot
    toe_height = 0.4 * of.ankle_height
    toes = box(
        TOES_SHARE * total,
        np.array([0.45 * toe_length, toe_height / 2 - frames.calcn_above_sole, 0.0]),
        np.array([toe_length, toe_height, of.foot_breadth]),
    )
    talus = ellipsoid(TALUS_SHARE * total, np.zeros(3), np.full(3, 0.4 * of.ankle_height))
    parts = [toes.moved(frames.toes_calcn), talus.moved(-frames.calcn_talus)]
    return {"calcn": without(foot, parts), "toes": toes, "talus": talus}


def _arm(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    forearm = segment_element(segment_shape("forearm", sex), mass, np.zeros(3), frames.wrist_ulna)
    half = MassElement(forearm.mass / 2, forearm.com, forearm.inertia / 2)  # bones share the forearm evenly
    return {
        "humerus": segment_element(segment_shape("upper_arm", sex), mass, np.zeros(3), frames.elbow_humerus),
        "ulna": half,
        "radius": half.moved(-frames.radius_ulna),
        "hand": segment_element(segment_shape("hand", sex), mass, np.zeros(3), frames.knuckle_hand),
    }
