"""Gross errors of the recorded forces, which other causes are looked for beyond: a swap and a late clock.

A clock that is late shifts forces that belong to another plate; its trace in the balance is found only once
each plate has its own again.
"""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.plates.centre_of_pressure import centre_of_pressure, surface_of
from solver.capture.plates.conditioning import PlateLoads
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.observed_trial import PlateScene, Scene, force_at, moments_aside

KEPT_SCENES = 32
KNOWN_MIDDLE_M = 0.02  # how far a plate's middle may be from that of the corners in the files
UNKNOWN_MIDDLE_M = 0.1  # or from that of the pressures, where the files have no corners


class GrossCause(Candidate):
    """An error without size: it is there or not, and the recording can be corrected."""

    @abstractmethod
    def correct_plates(self, plates: Sequence[PlateScene]) -> tuple[PlateScene, ...] | None:
        """All plates of a trial as they should have been recorded; None where it cannot be in this trial."""

    def target_corrected(self, target: str) -> str:
        """Which plate holds, in the recording corrected, the force that the files give to `target`."""
        return target

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The recording corrected less the recording."""
        plates = self.correct_plates(scene.plates)
        if plates is None:
            return None
        fixed = np.sum([plate.wrench_ground for plate in plates], axis=0) - scene.measured_ground
        return Signature.of_fixed(fixed)

    @staticmethod
    def beside_middles(
        plain: Signature, force_ground: Float[np.ndarray, "frames 3"], *plates: PlateScene
    ) -> Signature:
        """With what it changes if the plates' middles lie elsewhere, and the force with them."""
        known = all(plate.plate.corners_ground is not None for plate in plates)
        std_m = np.sqrt(len(plates)) * (KNOWN_MIDDLE_M if known else UNKNOWN_MIDDLE_M)
        return replace(plain, columns=moments_aside(force_ground), prior_std=np.full(2, std_m))

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Always."""
        return True


def _its(name: str) -> Any:
    """What the cause itself says."""
    return property(lambda beyond: getattr(beyond.cause, name))


def _its_own(name: str) -> Any:
    """What the cause itself answers, of trials whose gross error was corrected."""

    def answer(beyond: "Beyond", *asked: Any) -> Any:
        return getattr(beyond.cause, name)(*map(beyond.corrected, asked))

    return answer


@dataclass(frozen=True)
class Beyond(Candidate):
    """Another cause, in the recording whose gross error was corrected."""

    cause: Candidate
    gross: GrossCause

    about, id, place_odds, seen_elsewhere = map(_its, ("about", "id", "place_odds", "seen_elsewhere"))
    starts, prior, estimates, frames = map(_its_own, ("starts", "prior", "estimates", "frames"))
    steps, admissible, is_possible, is_notable = map(
        _its_own, ("steps", "admissible", "is_possible", "is_notable")
    )
    lifted_N, signature, unrecorded = map(_its_own, ("lifted_N", "signature", "unrecorded"))

    def corrected(self, asked: Any) -> Any:
        """A trial, or several, as they should have been recorded; anything else as it is."""
        if isinstance(asked, Scene):
            return correct_scene(self.gross, asked)
        several = isinstance(asked, tuple | list) and any(isinstance(one, Scene) for one in asked)
        return tuple(map(self.corrected, asked)) if several else asked


@lru_cache(maxsize=KEPT_SCENES)
def correct_scene(gross: GrossCause, scene: Scene) -> Scene:
    """A trial as it should have been recorded; kept."""
    plates = gross.correct_plates(scene.plates)
    return scene if plates is None else replace(scene, plates=plates)


def with_samples(
    plate: PlateScene, wrench_ground: Float[np.ndarray, "samples 6"], carrying: Bool[np.ndarray, " samples"]
) -> PlateScene:
    """The plate as if its samples had been others.

    Args:
        plate: as recorded.
        wrench_ground: zero where unloaded [N], about the ground origin [N·m].
        carrying: where it is loaded.
    """
    recorded = replace(
        plate.plate, force_ground=wrench_ground[:, :3], moment_ground=wrench_ground[:, 3:], point_ground=None
    )
    at_frames = np.nan_to_num(plate.at_frames(wrench_ground))
    return replace(
        plate,
        plate=recorded,
        loads=PlateLoads(wrench_ground, wrench_ground, carrying, plate.loads.recorded),
        wrench_ground=at_frames,
        loaded=at_frames[:, 1] >= plate.conditioning.threshold_N,
    )


def points_ground(plate: PlateScene) -> Float[np.ndarray, "samples 3"]:
    """Centre of pressure of each sample, from recorded force and moment [m]; zero where unloaded."""
    wrench = plate.loads.wrench_ground
    points = centre_of_pressure(wrench[:, :3], wrench[:, 3:], surface_of(plate.plate))
    return np.where(plate.loads.carrying[:, None], points, 0.0)


def wrench_change(
    plate: PlateScene, force_change_ground: Float[np.ndarray, "samples 3"]
) -> Float[np.ndarray, "frames 6"]:
    """Change of the plate's wrench at the frames; centres of pressure and free moments stay.

    Args:
        plate: as recorded.
        force_change_ground: of its samples, zero where unloaded [N].
    """
    return np.nan_to_num(plate.at_frames(force_at(force_change_ground, points_ground(plate))))
