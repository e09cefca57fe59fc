"""Plate bias: one plate reads a constant force too much.

A bias that the file shows on the unloaded plate, too, is taken off when forces are conditioned: the balance
then knows nothing of it, and the cause is named by comparison with what would be left without that. A bias
that does not show, because unloaded samples were set to zero, or is too large for a zero level, stays in the
balance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import contact_samples, gaps_filled
from solver.capture.plates.zero_level import less, unloaded_stretches
from solver.diagnosis.causes.about import About, Entry, Named, Size
from solver.diagnosis.causes.effect import Candidate, Corrected, Estimate, Eta, Signature
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.readings import Reading, along
from solver.diagnosis.causes.scene import PlateScene, Scene, force_at

PRIOR_STD_N = 15.0  # amplifiers drift by some newtons between tares, more over a hot day
LEAST_N = 5.0  # 6 N matter
LEVEL_STD_N = (
    0.2  # of a zero level that shows without noise: files are rounded, amplifiers are not that steady
)
BIASES = ("bias_x_N", "bias_y_N", "bias_z_N")


ABOUT = About(
    id="plate_bias",
    entry=Entry(
        "`plate_k`",
        "a constant force added at the plate's centre",
        "`bias_x_N`, `bias_y_N`, `bias_z_N`",
    ),
    title="constant error in the force of {target}",
    sentence="{target} adds a constant force to what it measures.",
    remedy=("Tare the plate right before each recording, with nobody on it, and let its amplifier warm up."),
    told_apart_by="a second of recording with nobody on the plate, before and after the trial",
    branch="plate/zero",
    names=Named.PLATES,
    odds_against=2.0,
    usual_std=1.4,
    asked_up_to=80.0,
    sizes=(Size("bias_y_N", 5.0, 40.0, 60.0, "after a tare; beyond, the zero level itself is wrong"),),
    readings=(
        Reading(
            "bias_y_N",
            "it reads {amount} too {which} along y (bias {signed})",
            "N",
            which=("much", "little"),
        ),
        *along("bias_{}_N", "it reads {{amount}} too far towards {{which}}", "N", axes="xz"),
    ),
    picture=Plates(),
)


TAKEN_OFF = replace(
    ABOUT,
    sentence=(
        "{target} reads a constant force while nobody stands on it; it was taken off as its zero level."
    ),
)


@dataclass(frozen=True)
class PlateBias(Candidate):
    """recorded = true + a constant force at the plate's centre, on every sample that counts as loaded."""

    about = ABOUT

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Less a newton along each axis at the plate's centre while it is loaded."""
        for plate in scene.plates:
            if plate.target == self.target and plate.loads.carrying.any():
                share = np.nan_to_num(plate.at_frames(plate.loads.carrying.astype(float)))
                newton = force_at(np.eye(3), np.tile(plate.centre_ground, (3, 1)))
                return Signature(-share[:, None, None] * newton.T, np.full(3, PRIOR_STD_N))
        return None

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "3"],
        covariance: Float[np.ndarray, "3 3"],
    ) -> dict[str, Estimate]:
        """bias_x_N, bias_y_N, bias_z_N."""
        std = np.sqrt(np.diag(covariance))
        return {name: Estimate(float(x[k]), float(std[k])) for k, name in enumerate(BIASES)}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what tared plates drift."""
        return _size_N(estimates) > LEAST_N


@dataclass(frozen=True)
class PlateBiasTakenOff(Corrected):
    """A bias that shows on the unloaded plate; the balance is already without it.

    Its gain is that of `measured_ground` of the scene over `uncorrected_ground`.
    """

    about = TAKEN_OFF

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Nothing: the correction is made. None where none was needed."""
        plate = _found(scene, self.target)
        if plate is None or taken_off(plate) is None:
            return None
        return Signature(np.zeros((scene.frames, 6, 0)), np.zeros(0), np.zeros((scene.frames, 6)))

    def uncorrected_ground(self, scene: Scene) -> Float[np.ndarray, "frames 6"]:
        """Wrench of all plates together if this one's zero level had been left as it was recorded.

        A level above the contact threshold then makes the plate seem loaded all the time.
        """
        plate = _found(scene, self.target)
        if plate is None or taken_off(plate) is None:
            return scene.measured_ground
        whole, recorded = _untared(plate)
        loaded = contact_samples(whole, plate.conditioning) & recorded
        wrench = np.where(loaded[:, None], _wrench(whole), 0.0)
        return scene.measured_ground - plate.wrench_ground + np.nan_to_num(plate.at_frames(wrench))

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "0"],
        covariance: Float[np.ndarray, "0 0"],
    ) -> dict[str, Estimate]:
        """bias_x_N, bias_y_N, bias_z_N: mean over the trials that show it."""
        levels, variances = [], []
        for scene in scenes:
            plate = _found(scene, self.target)
            level = None if plate is None else taken_off(plate)
            if plate is not None and level is not None:
                levels.append(level[:3])
                variances.append(_level_std_N(plate) ** 2 + LEVEL_STD_N**2)
        mean = np.mean(levels, axis=0)
        std = np.sqrt(np.mean(variances, axis=0) / len(levels) + np.var(levels, axis=0))
        return {name: Estimate(float(mean[k]), float(std[k])) for k, name in enumerate(BIASES)}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what tared plates drift."""
        return _size_N(estimates) > LEAST_N


def taken_off(plate: PlateScene) -> Float[np.ndarray, "6"] | None:
    """Force [N] and moment about the ground origin [N·m] that came off; None if nothing."""
    whole, _ = _untared(plate)
    level = np.median(_wrench(whole) - plate.loads.raw_ground, axis=0)
    return level if level.any() else None


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One for each plate, and another for each that was relieved of a zero level."""
    plates = [plate for scene in scenes for plate in scene.plates if plate.loads.carrying.any()]
    corrected = dict.fromkeys(plate.target for plate in plates if taken_off(plate) is not None)
    return [
        *(PlateBias(target) for target in dict.fromkeys(plate.target for plate in plates)),
        *(PlateBiasTakenOff(target) for target in corrected),
    ]


def _found(scene: Scene, target: str) -> PlateScene | None:
    return next((plate for plate in scene.plates if plate.target == target), None)


def _untared(plate: PlateScene) -> tuple[ForcePlate, Bool[np.ndarray, " samples"]]:
    """The plate conditioned but for its zero level, and which samples were recorded."""
    whole, recorded, _ = gaps_filled(plate.plate, plate.conditioning)
    level = plate.plate.zero_ground
    return whole if level is None else less(whole, -level[None]), recorded


def _wrench(plate: ForcePlate) -> Float[np.ndarray, "samples 6"]:
    return np.concatenate([plate.force_ground, plate.moment_ground], axis=1)


def _level_std_N(plate: PlateScene) -> Float[np.ndarray, "3"]:
    """Of the level: what the unloaded plate scatters, by the number of stretches that tell it apart."""
    whole, _, _ = gaps_filled(plate.plate, plate.conditioning)
    unloaded = unloaded_stretches(whole, plate.conditioning)
    if not unloaded.any():
        return np.zeros(3)
    stretches = unloaded.sum() / (plate.conditioning.zero_stretch_s * whole.rate)
    return np.asarray(whole.force_ground[unloaded].std(axis=0) / np.sqrt(max(stretches, 1.0)))


def _size_N(estimates: dict[str, Estimate]) -> float:
    return float(np.linalg.norm([estimates[name].value for name in BIASES]))
