"""The default full body: 22 bodies and 37 degrees of freedom, built from published tables.

Bodies, joints and coordinates carry OpenSim's usual names and signs, and body frames lie where OpenSim's do
(x forward, y up, z right; pelvis between the anterior spines, femur at the hip, tibia at the knee, calcn at
the heel, torso at the lumbar joint), so that bone meshes drawn for OpenSim fit. The numbers are those of
`solver.skeleton.segment_tables`; its left side is the mirror image of the right.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.skeleton.default_bones import DefaultBones
from solver.skeleton.default_frames import BodyFrames, body_frames
from solver.skeleton.default_markers import default_markers
from solver.skeleton.default_masses import mass_elements
from solver.skeleton.functions import CubicSpline, Linear, ScalarFunction
from solver.skeleton.mass_elements import MassElement
from solver.skeleton.segment_tables import (
    ANKLE_AXIS,
    KNEE_ROLL_BACK_AT_120_DEG,
    METATARSAL_BREAK_AXIS,
    PATELLA_FLEXION_RATIO,
    RANGES_DEG,
    SUBTALAR_AXIS,
    Lengths,
    Sex,
    lengths,
)
from solver.skeleton.skeleton import Axis, Body, Coordinate, Joint, Skeleton

X, Y, Z = np.eye(3)
_SAME = Linear(1.0, 0.0)
_PELVIS_REACH_M = 100.0  # a walkway's length: translations have no anatomical range


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
