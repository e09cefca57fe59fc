"""A plate whose wrench was moved as a whole: turned or mirrored about its middle, or in other units."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.effect import Estimate, Eta, Paths, Signature, Turn
from solver.diagnosis.causes.gross_cause import GrossCause, with_samples
from solver.diagnosis.causes.scene import PlateScene, Scene
from solver.dynamics.root_wrench import about_point
from solver.skeleton.forward import cross

KNOWN_MIDDLE_M = 0.02  # how far the middle may be from that of the corners in the files
UNKNOWN_MIDDLE_M = 0.1  # or from that of the pressures, where the files have no corners


def turn_of(R: Float[np.ndarray, "2 2"]) -> Turn:
    """The name of a turn or mirror of x and z by quarters."""
    return tuple(int(entry) for entry in np.round(R).ravel())


@dataclass(frozen=True)
class RearrangedPlate(GrossCause):
    """One plate moved as a whole about a middle that is known more or less."""

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
        return tuple(self._corrected(p) if p.target == self.target else p for p in plates)

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The plate corrected less the plate, and what a middle that lies elsewhere changes."""
        plain = super().signature(scene, eta)
        if plain is None or np.array_equal(self.R_true_recorded, np.eye(3)):
            return plain
        corrected = self.correct_plates(scene.plates)
        assert corrected is not None
        plate = next(p for p in corrected if p.target == self.target)
        columns = np.zeros((scene.frames, 6, 2))
        for k, axis in enumerate(np.eye(3)[[0, 2]]):
            columns[:, 3:, k] = cross(axis, plate.wrench_ground[:, :3])
        known = plate.plate.corners_ground is not None
        return replace(
            plain,
            columns=columns,
            prior_std=np.full(2, KNOWN_MIDDLE_M if known else UNKNOWN_MIDDLE_M),
        )

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, " parameters"],
        covariance: Float[np.ndarray, "parameters parameters"],
    ) -> dict[str, Estimate]:
        """What it is; known exactly if it is there."""
        return self.as_found

    @property
    @abstractmethod
    def as_found(self) -> dict[str, Estimate]:
        """Its parameters."""

    def _corrected(self, plate: PlateScene) -> PlateScene:
        R, wrench = self.R_true_recorded, plate.loads.wrench_ground
        middle = np.broadcast_to(plate.centre_ground, wrench[:, :3].shape)
        recorded = about_point(wrench, middle)
        force, moment = recorded[:, :3] @ R.T, np.linalg.det(R) * recorded[:, 3:] @ R.T
        moved = about_point(self.scale * np.concatenate([force, moment], axis=1), -middle)
        return with_samples(plate, moved, plate.loads.carrying)
