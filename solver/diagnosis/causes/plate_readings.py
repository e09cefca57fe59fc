"""What one plate reads too much or too little: a gain, a constant, a zero level, an object on it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import contact_samples, fill_gaps
from solver.capture.plates.zero_level import ZERO_STRETCH_S, less, unloaded_stretches
from solver.common.gravity import GRAVITY
from solver.common.plate_figures import HALF_SIDE_M
from solver.diagnosis.causes.about import About, AtFault, Entry, Named, Plates, Reading, Size, along
from solver.diagnosis.causes.effect import (
    Candidate,
    Corrected,
    Estimate,
    Eta,
    Fitted,
    InTrials,
    OfOnePlate,
    Signature,
    all_and_each,
)
from solver.diagnosis.causes.observed_trial import PlateScene, Scene, force_at, loaded_plates

GAIN_STD = 0.05  # plates are off by 1 to 5 %
MOST_LEFT = 0.5  # of the plate's force
BIAS_STD_N = 15.0  # amplifiers drift by some newtons between tares, more over a hot day
LEVEL_STD_N = 0.2  # of a level that shows without noise: files are rounded, amplifiers not that steady
ZERO_STD_N = 100.0  # what stood on it when it was tared, or amplifiers that never were
LEVER_M = 0.15  # a quarter of a plate's side: how far from the middle that was
OBJECT_KG = 6.0  # a chair, a box, a rucksack that was put down
MOST_ASIDE_M = 0.8  # farther off it stands on another plate, or nowhere
LEAST_OBJECT_KG = 1.0  # a shoe
WEIGHT_STDS = 3.0  # with fewer, only moments are seen, which a wrong centre of mass has as well
FORCES = tuple(f"force_{axis}_N" for axis in "xyz")
MOMENTS = tuple(f"moment_{axis}_Nm" for axis in "xyz")
ASIDE = ("aside_x_m", "aside_z_m")


@dataclass(frozen=True)
class PlateGain(OfOnePlate):
    """recorded = (1 + gain_error) × true, force and moment: true − recorded = −gain_error × true.

    True is what the motion demands of the plate, not what it recorded. What a sound balance leaves is what
    the fitted motion does not tell, and so has nothing to do with the demand; but it is part of the recorded
    force, so that a factor on that would shrink noise and seem to explain it.
    """

    about = About(
        id="plate_gain",
        entry=Entry("`plate_k`", "recorded = (1 + gain error) × true, force and moment", "`gain_error`"),
        title="wrong gain of {target}",
        sentence="{target} reads too much or too little by a constant factor.",
        remedy=("Put a known weight on the plate at several places and correct its calibration matrix."),
        separate_by=(
            "the plate empty, then with two known weights: an error that grows with the weight is a gain,"
            " the same error each time is a constant one"
        ),
        branch="plate/scale",
        names=Named.PLATES,
        odds_against=2.0,
        asked_up_to=20.0,
        sizes=(Size("gain_error", 0.03, 0.10, 0.20, "beyond, the units are wrong"),),
        readings=(
            Reading("gain_error", "it reads {amount} too {which}", "%", 1e2, which=("much", "little")),
        ),
        picture=Plates(),
    )
    parameters = ("gain_error",)
    least = 0.015  # within what plates of one laboratory scatter
    most = 0.2  # a plate that is off by more has the wrong units, or another fault

    def of_plate(self, plate: PlateScene, scene: Scene, eta: Eta) -> Signature:
        """Less what the motion demands of the plate."""
        return Signature(-required_of(plate, scene)[:, :, None], np.array([GAIN_STD]))


def required_of(plate: PlateScene, scene: Scene) -> Float[np.ndarray, "frames 6"]:
    """Wrench about the ground origin [N], [N·m]: the recorded one and its share of what all leave.

    The share is that of the vertical force. Where more than half of the plate's force is left, something else
    is wrong, and the recorded wrench is as good.
    """
    total = np.sum([p.loaded * p.wrench_ground[:, 1] for p in scene.plates], axis=0)
    own = plate.wrench_ground
    share = np.divide(own[:, 1], total, out=np.zeros(len(total)), where=plate.loaded & (total > 0))
    left = scene.required_ground - scene.measured_ground
    usual = np.linalg.norm(left[:, :3], axis=1) < MOST_LEFT * np.linalg.norm(own[:, :3], axis=1)
    return own + np.where(usual, np.clip(share, 0.0, 1.0), 0.0)[:, None] * left


@dataclass(frozen=True)
class PlateBias(Candidate):
    """recorded = true + a constant force at the plate's centre, on every sample that counts as loaded.

    A bias that the file shows on the unloaded plate, too, is taken off when forces are conditioned: the
    balance then knows nothing of it, and `PlateBiasTakenOff` compares with what would be left without that.
    A bias that does not show, because unloaded samples were set to zero, or is too large for a zero level,
    stays in the balance.
    """

    about = About(
        id="plate_bias",
        entry=Entry(
            "`plate_k`", "a constant force added at the plate's centre", "`bias_x_N`, `bias_y_N`, `bias_z_N`"
        ),
        title="constant error in the force of {target}",
        sentence="{target} adds a constant force to what it measures.",
        remedy=(
            "Tare the plate right before each recording, with nobody on it, and let its amplifier warm up."
        ),
        separate_by="a second of recording with nobody on the plate, before and after the trial",
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
    parameters = ("bias_x_N", "bias_y_N", "bias_z_N")
    least = 5.0  # [N] what tared plates drift; 6 N matter

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Less a newton along each axis at the plate's centre while it is loaded."""
        plate = scene.carrying_plate(self.target)
        if plate is None:
            return None
        newton = force_at(np.eye(3), np.tile(plate.centre_ground, (3, 1)))
        return Signature(-plate.carrying_share[:, None, None] * newton.T, np.full(3, BIAS_STD_N))

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One for each plate, and another for each that was relieved of a zero level."""
        plates = [plate for scene in scenes for plate in scene.plates if plate.loads.carrying.any()]
        corrected = dict.fromkeys(plate.target for plate in plates if level_taken_off(plate) is not None)
        return [
            *(cls(target) for target in dict.fromkeys(plate.target for plate in plates)),
            *(PlateBiasTakenOff(target) for target in corrected),
        ]


@dataclass(frozen=True)
class PlateBiasTakenOff(PlateBias, Corrected):
    """A bias that shows on the unloaded plate; the balance is already without it.

    Its gain is that of `measured_ground` of the scene over `uncorrected_ground`.
    """

    about = replace(
        PlateBias.about,
        sentence=(
            "{target} reads a constant force while nobody stands on it; it was taken off as its zero level."
        ),
    )

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Nothing: the correction is made. None where none was needed."""
        return Signature.of_fixed(np.zeros((scene.frames, 6))) if self._correct(scene) else None

    def uncorrected_ground(self, scene: Scene) -> Float[np.ndarray, "frames 6"]:
        """Wrench of all plates together if this one's zero level had been left as it was recorded.

        A level above the contact threshold then makes the plate seem loaded all the time.
        """
        corrected = self._correct(scene)
        if corrected is None:
            return scene.measured_ground
        plate, _ = corrected
        whole, recorded = _untared(plate)
        loaded = contact_samples(whole, plate.conditioning) & recorded
        wrench = np.where(loaded[:, None], _wrench(whole), 0.0)
        return scene.measured_ground - plate.wrench_ground + np.nan_to_num(plate.at_frames(wrench))

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """The level that came off: mean over the trials that show it."""
        shown = [one for scene in scenes if (one := self._correct(scene)) is not None]
        levels = [level[:3] for _, level in shown]
        variances = [_level_std_N(plate) ** 2 + LEVEL_STD_N**2 for plate, _ in shown]
        mean = np.mean(levels, axis=0)
        std = np.sqrt(np.mean(variances, axis=0) / len(levels) + np.var(levels, axis=0))
        return {name: Estimate(float(mean[k]), float(std[k])) for k, name in enumerate(self.parameters)}

    def _correct(self, scene: Scene) -> tuple[PlateScene, Float[np.ndarray, "6"]] | None:
        """The plate, and the level that came off it."""
        plate = next((plate for plate in scene.plates if plate.target == self.target), None)
        level = None if plate is None else level_taken_off(plate)
        return None if plate is None or level is None else (plate, level)


def level_taken_off(plate: PlateScene) -> Float[np.ndarray, "6"] | None:
    """Force [N] and moment about the ground origin [N·m] that came off; None if nothing."""
    whole, _ = _untared(plate)
    level = np.median(_wrench(whole) - plate.loads.raw_ground, axis=0)
    return level if level.any() else None


def _found(scene: Scene, target: str) -> PlateScene | None:
    return next((plate for plate in scene.plates if plate.target == target), None)


def _untared(plate: PlateScene) -> tuple[ForcePlate, Bool[np.ndarray, " samples"]]:
    """The plate conditioned but for its zero level, and which samples were recorded."""
    whole, recorded, _ = fill_gaps(plate.plate, plate.conditioning)
    level = plate.plate.zero_ground
    return whole if level is None else less(whole, -level[None]), recorded


def _wrench(plate: ForcePlate) -> Float[np.ndarray, "samples 6"]:
    return np.concatenate([plate.force_ground, plate.moment_ground], axis=1)


def _level_std_N(plate: PlateScene) -> Float[np.ndarray, "3"]:
    """Of the level: what the unloaded plate scatters, by the number of stretches that tell it apart."""
    whole, _, _ = fill_gaps(plate.plate, plate.conditioning)
    unloaded = unloaded_stretches(whole, plate.conditioning)
    if not unloaded.any():
        return np.zeros(3)
    stretches = unloaded.sum() / (ZERO_STRETCH_S * whole.rate)
    return np.asarray(whole.force_ground[unloaded].std(axis=0) / np.sqrt(max(stretches, 1.0)))


@dataclass(frozen=True)
class ZeroLevel(Candidate):
    """recorded = true + a constant force and moment about the plate's middle, while it is loaded.

    The plate was not tared, or with somebody on it; its constant part is no drift of amplifiers. Where the
    plate is seen empty, reading finds that level and takes it off (`capture.plates.zero_level`). Where nobody
    ever leaves it, or the level is too large to be told from a load, it stays in the balance. A plate that
    reads next to nothing for a while has none: what zeroes the samples below a threshold leaves so much.
    """

    about = About(
        id="zero_level",
        entry=Entry(
            "`plate_k`",
            (
                "not tared, or under load: a constant force and moment (about the plate's middle) in all "
                "it reads"
            ),
            "`force_x_N`, `force_y_N`, `force_z_N`, `moment_x_Nm`, `moment_y_Nm`, `moment_z_Nm`",
        ),
        title="wrong zero level of {target}",
        sentence=(
            "{target} was not tared, or something stood on it when it was: a constant is in all it reads."
        ),
        remedy="Tare the plate with nobody on it, or take off what it reads while it is empty.",
        separate_by="a second of recording with nobody on the plate, before and after the trial",
        branch="plate/zero",
        names=Named.PLATES,
        odds_against=2.0,
        sizes=(
            Size("force_y_N", 100.0, 1000.0, 10000.0, "not tared, or under load; a plate's range at most"),
        ),
        readings=(
            Reading("force_y_N", "it reads {amount} too {which} along y", "N", which=("much", "little")),
            *along("force_{}_N", "{{amount}} too far towards {{which}}", "N", axes="xz"),
            *along("moment_{}_Nm", "{{amount}} too much about its middle's {{which}}", "N·m"),
        ),
        picture=Plates(),
    )
    parameters = (*FORCES, *MOMENTS)
    least = 40.0  # [N] less is what tared plates drift at most; of a moment, at that lever

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Less a newton along, and a newton metre about, each axis at the middle."""
        plate = scene.carrying_plate(self.target)
        if plate is None:
            return None
        forces = force_at(np.eye(3), np.tile(plate.centre_ground, (3, 1)))
        moments = np.concatenate([np.zeros((3, 3)), np.eye(3)], axis=1)
        constant = np.concatenate([forces, moments]).T
        prior_std = ZERO_STD_N * np.repeat([1.0, LEVER_M], 3)
        return Signature(-plate.carrying_share[:, None, None] * constant, prior_std)

    def size(self, estimates: dict[str, Estimate]) -> float:
        """Of force and moment, the latter over the lever [N]."""
        forces = [estimates[name].value for name in FORCES]
        return float(np.linalg.norm([*forces, *(estimates[name].value / LEVER_M for name in MOMENTS)]))

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One for each plate that somebody is on and that is never seen empty."""
        empty = {p.target for scene in scenes for p in scene.plates if p.seen_empty}
        return [cls(target) for target in loaded_plates(scenes) if target not in empty]


@dataclass(frozen=True)
class ObjectOnPlate(InTrials):
    """recorded = true + W upward at a point of the plate, on every sample that was recorded as loaded.

    Linear in W, W (p_x − c_x) and W (p_z − c_z), with c the plate's middle. A plate that was seen empty, with
    less on it than a contact's threshold, bears no more than that.
    """

    about = About(
        id="object_on_plate",
        entry=Entry(
            "`plate_k`",
            "something stands on the plate all the time, also while the foot is away",
            "`mass_kg`, `aside_x_m`, `aside_z_m` (from the plate's middle)",
        ),
        title="an object on {target}",
        sentence="Something stands on {target} all the time and is measured with the person.",
        remedy=(
            "Take it off the plate and record again, or weigh it and take its weight off this plate's forces."
        ),
        separate_by="a second of recording with nobody on the plate, with and without the object",
        branch="ground/object on a plate",
        names=Named.PLATES,
        at_fault=AtFault.MOVEMENT,
        odds_against=4.0,
        sizes=(Size("mass_kg", 5.0, 20.0, 60.0, "a chair, a box; beyond, another person"),),
        readings=(
            Reading("mass_kg", "it weighs {amount}", "kg"),
            *along(
                "aside_{}_m", "{{amount}} from the plate's middle towards {{which}}", "mm", 1e3, axes="xz"
            ),
        ),
        picture=Plates(),
    )

    most_N: float = math.inf  # what it may weigh

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Less a newton upwards at the middle, and its moments a metre beside it along x and z."""
        plate = scene.carrying_plate(self.target)
        if plate is None or self.trial not in (None, scene.name):
            return None
        up = np.array([0.0, 1.0, 0.0])
        middle = force_at(up, plate.centre_ground)
        aside = [force_at(up, plate.centre_ground + axis) - middle for axis in np.eye(3)[[0, 2]]]
        newton = np.stack([middle, *aside], axis=1)
        prior_std = OBJECT_KG * GRAVITY * np.array([1.0, HALF_SIDE_M, HALF_SIDE_M])
        return Signature(-plate.carrying_share[:, None, None] * newton, prior_std)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """mass_kg, and how far from the plate's middle it stands by division."""
        weight = fit.estimate(0)
        found = {"mass_kg": Estimate(weight.value / GRAVITY, weight.std / GRAVITY)}
        return found | {name: fit.ratio(i) for i, name in enumerate(ASIDE, start=1)}

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """It weighs something, and stands on or near the plate."""
        aside_m = math.hypot(*(estimates[name].value for name in ASIDE))
        return 0 < GRAVITY * estimates["mass_kg"].value < self.most_N and aside_m < MOST_ASIDE_M

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Heavier than a shoe, and a weight, not just a moment."""
        mass = estimates["mass_kg"]
        return mass.value > max(LEAST_OBJECT_KG, WEIGHT_STDS * mass.std)

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """On each plate: in all trials, and in each alone where there are several."""
        found: list[Candidate] = []
        for trial in all_and_each(scenes):
            for target in loaded_plates(scenes):
                own = [p for s in scenes for p in s.plates if p.target == target and trial in (None, s.name)]
                limits = [p.conditioning.threshold_N for p in own if p.seen_empty]
                found.append(cls(target, trial, min(limits, default=math.inf)))
        return found
