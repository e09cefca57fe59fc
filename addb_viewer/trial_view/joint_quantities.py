"""What joints have over time, in words: angle, speed, torque and power, of both sides at once."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from addb_viewer.text.coordinate_words import Coordinate, motion_in_words
from addb_viewer.trial_view.replay import JointReplay


class Kind(StrEnum):
    """What of a coordinate, as `TrialStd` calls it."""

    POSITION = "angle"
    SPEED = "speed"
    TORQUE = "torque"
    POWER = "power"

    @property
    def rests_on_forces(self) -> bool:
        """Whether it means little on frames whose forces do not count."""
        return self in (Kind.TORQUE, Kind.POWER)


PER_KG = "/kg"
SAGITTAL = ("hip_flexion", "knee_angle", "ankle_angle")  # what a leg does in walking, first of all
UNITS = {
    Kind.POSITION: ("°", "m"),
    Kind.SPEED: ("°/s", "m/s"),
    Kind.TORQUE: ("N·m", "N"),
    Kind.POWER: ("W", "W"),
}  # of what rotates, and of what moves along
TITLES = {
    Kind.POSITION: ("angle", ""),
    Kind.SPEED: ("speed", "speed"),
    Kind.TORQUE: ("torque", "force"),
    Kind.POWER: ("power", "power"),
}
ALSO = {
    Kind.POSITION: "position kinematics",
    Kind.SPEED: "velocity",
    Kind.TORQUE: "moment",
    Kind.POWER: "work",
}  # other words by which people look for it


@dataclass(frozen=True)
class JointQuantity:
    """One thing that can be shown, of all sides that the model has."""

    id: str  # "knee_angle torque", whatever the model's range
    words: str  # "Knee flexion torque"
    unit: str
    kind: Kind
    columns: tuple[tuple[str, int], ...]  # right, left, or nothing; and which coordinate
    divisor: float = 1.0  # of the values: the person's mass [kg], where the unit is per kg

    @property
    def stem(self) -> str:
        """The model's name of the coordinate, without its side."""
        return self.id.rpartition(" ")[0]

    def told(self, side: str) -> str:
        """Of one side, within a sentence: "right knee flexion torque"."""
        words = f"{self.words[:1].lower()}{self.words[1:]}"
        return f"{side} {words}" if side else words

    def named(self, side: str) -> str:
        """As a name in a file: right_knee_flexion_torque."""
        return self.told(side).replace(" ", "_")

    def of(self, joints: JointReplay) -> "JointQuantity | None":
        """The same of another trial, or of another solve; None where that has no such joint."""
        found = quantities_of(joints, per_kg=self.unit.endswith(PER_KG))
        return next((quantity for quantity in found if quantity.id == self.id), None)

    def values(self, joints: JointReplay, column: int) -> Float[np.ndarray, " frames"]:
        """In `unit`.

        Args:
            joints: of which it is a quantity.
            column: of `columns`.
        """
        values = _values(joints, self.kind)
        assert values is not None
        return self._in_unit(values[:, column])

    def std(self, joints: JointReplay, column: int) -> Float[np.ndarray, " frames"] | None:
        """Standard deviations likewise, NaN where none is known; None: nowhere."""
        std = None if joints.std is None else getattr(joints.std, self.kind)[:, column]
        return None if std is None or np.isnan(std).all() else self._in_unit(std)

    def _in_unit(self, values: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
        of_one = values / self.divisor
        return np.degrees(of_one) if self.unit.startswith("°") else of_one


def quantities_of(joints: JointReplay, *, per_kg: bool = False) -> tuple[JointQuantity, ...]:
    """All that can be shown, joint by joint in the model's order; the right side first.

    Forces and torques of the root joint are left out: they are the residual.

    Args:
        joints: of a trial.
        per_kg: torques, forces and powers for each kilogram of the person, where the mass is known.
    """
    mass = joints.mass_kg if per_kg else None
    stems: dict[str, list[tuple[str, int]]] = {}
    for i, name in enumerate(joints.names):
        stem, side = Coordinate.named(name)
        stems.setdefault(stem, []).append((side, i))
    return tuple(q for stem, columns in stems.items() for q in _of_stem(joints, stem, columns, mass))


def _of_stem(
    joints: JointReplay, stem: str, columns: list[tuple[str, int]], mass: float | None
) -> Iterator[JointQuantity]:
    columns = sorted(columns, key=lambda found: found[0] != "right")
    first = columns[0][1]
    name, turns = joints.names[first], 0 if joints.rotates[first] else 1
    motion = motion_in_words(name, joints.limits[first] if joints.limits else None)
    for kind in Kind:
        if _values(joints, kind) is None or (kind.rests_on_forces and name in joints.of_root):
            continue
        called = TITLES[kind][turns]
        words = motion if not called else f"{motion.removesuffix(' angle')} {called}"
        words = f"predicted {words}" if joints.predicted and kind.rests_on_forces else words
        capital = words[:1].upper() + words[1:]
        unit, divisor = UNITS[kind][turns], 1.0
        if mass is not None and kind.rests_on_forces:
            unit, divisor = f"{unit}{PER_KG}", mass
        yield JointQuantity(f"{stem} {kind}", capital, unit, kind, tuple(columns), divisor)


def _values(joints: JointReplay, kind: Kind) -> Float[np.ndarray, "frames dofs"] | None:
    return {
        Kind.POSITION: joints.position,
        Kind.SPEED: joints.speed,
        Kind.TORQUE: joints.torque,
        Kind.POWER: joints.power,
    }[kind]
