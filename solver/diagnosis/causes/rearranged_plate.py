"""A plate that the files have turned, mirrored or in other units, as a whole about its middle."""

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, Entry, Named, Plates, Reading
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, Paths, Signature, Turn
from solver.diagnosis.causes.gross_cause import GrossCause, with_samples
from solver.diagnosis.causes.observed_trial import PlateScene, Scene, loaded_plates
from solver.dynamics.root_wrench import about_point

TURNS_DEG = (90, 180, -90)
MIRRORS = {
    0: np.diag([-1.0, 1.0, 1.0]),
    90: np.diag([1.0, 1.0, -1.0]),
    45: np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    -45: np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
}  # by the direction of the axis that is reversed, degrees from x towards z
ERRORS_LAST_S = 0.06  # of what the model gets wrong
MOST_ROWS = 600.0
FACTORS = (1 / 9.80665, 1 / 4.448222, 0.25, 0.5, 2.0, 4.0, 4.448222, 9.80665)
# recorded over true: kilograms and pounds for newtons, and the other way; amplifiers' ranges


def turn_of(R: Float[np.ndarray, "2 2"]) -> Turn:
    """The name of a turn or mirror of x and z by quarters."""
    return tuple(int(entry) for entry in np.round(R).ravel())


@dataclass(frozen=True)
class RearrangedPlate(GrossCause):
    """One plate moved as a whole about a middle that is known more or less."""

    value: float = 1.0  # of its parameter
    path_nats: float = field(default=0.0, kw_only=True)

    @property
    def seen_elsewhere(self) -> float:
        """How much better the plate's pressures follow the foot with it, without any model of the body."""
        return self.path_nats

    def with_evidence(self, paths: Paths) -> Self:
        """With what the path says of this turn or mirror."""
        turn = turn_of(self.R_true_recorded[np.ix_([0, 2], [0, 2])])
        return replace(self, path_nats=paths.get(self.target, {}).get(turn, 0.0))

    @property
    @abstractmethod
    def R_true_recorded(self) -> Float[np.ndarray, "3 3"]:
        """Turn or mirror of a force; a moment goes by its determinant times that."""

    @property
    def scale(self) -> float:
        """Of true forces and moments over recorded ones."""
        return 1.0

    def correct_plates(self, plates: Sequence[PlateScene]) -> tuple[PlateScene, ...] | None:
        """The plate as it should have been recorded, about its middle."""
        if not any(plate.target == self.target and plate.loaded.any() for plate in plates):
            return None
        return tuple(self._correct(p) if p.target == self.target else p for p in plates)

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The plate corrected less the plate, and what a middle that lies elsewhere changes."""
        plain = super().signature(scene, eta)
        if plain is None or np.array_equal(self.R_true_recorded, np.eye(3)):
            return plain
        corrected = self.correct_plates(scene.plates)
        assert corrected is not None
        plate = next(p for p in corrected if p.target == self.target)
        return self.beside_middles(plain, plate.wrench_ground[:, :3], plate)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """What it is; known exactly if it is there."""
        return {self.parameters[0]: Estimate(float(self.value), 0.0)}

    def _correct(self, plate: PlateScene) -> PlateScene:
        R, wrench = self.R_true_recorded, plate.loads.wrench_ground
        middle = np.broadcast_to(plate.centre_ground, wrench[:, :3].shape)
        recorded = about_point(wrench, middle)
        force, moment = recorded[:, :3] @ R.T, np.linalg.det(R) * recorded[:, 3:] @ R.T
        moved = about_point(self.scale * np.concatenate([force, moment], axis=1), -middle)
        return with_samples(plate, moved, plate.loads.carrying)


@dataclass(frozen=True)
class PlateTurn(RearrangedPlate):
    """recorded = R_y(turn) true, force and moment about the plate's middle, pressures with them."""

    about = About(
        id="plate_turn",
        entry=Entry(
            "`plate_k`",
            (
                "recorded force, moment and pressure turned by a quarter or a half about the vertical "
                "through the plate's middle"
            ),
            "`turn_deg`",
        ),
        title="{target} turned by 90° or 180°",
        sentence="In the files the axes of {target} are turned by 90° or 180° about the vertical.",
        remedy=(
            "Compare the order of the plate's corners, and its x and y, with how it lies in the "
            "floor, and put them right in the laboratory's files."
        ),
        separate_by="a push against the plate in a known direction, at a known place off its middle",
        branch="plate/geometry",
        names=Named.PLATES,
        odds_against=2.0,
        readings=(Reading("turn_deg", "recorded turned by {signed} about the vertical", "°"),),
        picture=Plates(),
    )
    parameters = ("turn_deg",)

    @property
    def R_true_recorded(self) -> Float[np.ndarray, "3 3"]:
        """Turned back."""
        c, s = np.round(np.cos(np.radians(self.value))), np.round(np.sin(np.radians(self.value)))
        return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """Each turn of each plate."""
        return [cls(target, turn) for target in loaded_plates(scenes) for turn in TURNS_DEG]


@dataclass(frozen=True)
class PlateMirror(RearrangedPlate):
    """recorded = M true about the plate's middle, M a reflection; moments go by −M, being no vectors."""

    about = About(
        id="plate_mirror",
        entry=Entry(
            "`plate_k`",
            "one horizontal axis of force and pressure reversed about the plate's middle",
            "`mirrored_axis_deg` (from x towards z)",
        ),
        title="{target} mirrored",
        sentence="One horizontal axis of {target} points the other way in the files, for force and pressure.",
        remedy=(
            "Compare the order in which the files list the plate's corners with how it lies in the "
            "floor: they go round the wrong way, or one axis has the wrong sign."
        ),
        separate_by="a push against the plate in a known direction, at a known place off its middle",
        branch="plate/geometry",
        names=Named.PLATES,
        odds_against=2.0,
        readings=(
            Reading("mirrored_axis_deg", "the axis that is reversed lies at {signed} from x towards z", "°"),
        ),
        picture=Plates(),
    )
    parameters = ("mirrored_axis_deg",)

    @property
    def R_true_recorded(self) -> Float[np.ndarray, "3 3"]:
        """A reflection undoes itself."""
        return MIRRORS[int(self.value)]

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """Each mirror of each plate."""
        return [cls(target, axis) for target in loaded_plates(scenes) for axis in MIRRORS]


@dataclass(frozen=True)
class PlateUnits(RearrangedPlate):
    """recorded = factor × true, force and moment."""

    rows: float = 0.0  # independent means of force and moment that the plate gave while it was loaded

    about = About(
        id="plate_units",
        entry=Entry(
            "`plate_k`", "recorded = factor × true: kilograms, pounds, a range of the amplifier", "`factor`"
        ),
        title="wrong units of {target}",
        sentence=(
            "{target} reads a multiple of the true force: other units, or a wrong range of its amplifier."
        ),
        remedy=(
            "Check the units of this plate's channels in the export (N, kg, lb) and the range that "
            "its amplifier is set to; put a known weight on it."
        ),
        separate_by="a known weight on the plate",
        branch="plate/scale",
        names=Named.PLATES,
        odds_against=2.0,
        readings=(Reading("factor", "it reads {amount} of the true force", "times"),),
        picture=Plates(),
    )
    parameters = ("factor",)

    @property
    def seen_elsewhere(self) -> float:
        """What a factor above 1 gains by nothing but smaller numbers.

        Halved forces leave smaller rests, whatever is wrong. With recorded = factor × true the density of
        what was recorded is that of what is true, divided by the factor, in each independent mean. A factor
        below 1 would be rewarded likewise; where it is not right it makes rests larger, and needs no reward.
        """
        return -self.rows * max(0.0, math.log(self.value))

    @property
    def R_true_recorded(self) -> Float[np.ndarray, "3 3"]:
        """None."""
        return np.eye(3)

    @property
    def scale(self) -> float:
        """Over what was recorded."""
        return 1 / self.value

    def plate_factors(self) -> dict[str, float]:
        """A weight on the plate is read so many times."""
        return {self.target: self.value}

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """Each factor of each plate."""
        return [
            cls(target, factor, _independent_rows(scenes, target))
            for target in loaded_plates(scenes)
            for factor in FACTORS
        ]


def _independent_rows(scenes: Sequence[Scene], target: str) -> float:
    """Three forces and three moments in each stretch as long as errors last, as far as a balance has rows."""
    loaded_s = sum(p.loaded.sum() / s.rate for s in scenes for p in s.plates if p.target == target)
    return min(6.0 * float(loaded_s) / ERRORS_LAST_S, MOST_ROWS)
