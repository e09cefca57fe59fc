"""Zero level: one plate was not tared, or with somebody on it; its constant part is no drift of amplifiers.

Where the plate is seen empty, reading finds that level and takes it off (`capture.plates.zero_level`). Where
nobody ever leaves it, or the level is too large to be told from a load, it stays in the balance. A plate that
reads next to nothing for a while has none: what zeroes the samples below a threshold leaves so much standing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, Entry, Named, Size
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.readings import Reading, along
from solver.diagnosis.causes.scene import Scene, force_at, loaded_plates

PRIOR_STD_N = 100.0  # what stood on it when it was tared, or amplifiers that never were
LEVER_M = 0.15  # a quarter of a plate's side: how far from the middle that was
LEAST_N = 40.0  # less is what tared plates drift at most (`plate_bias`); of a moment, at that lever
FORCES = tuple(f"force_{axis}_N" for axis in "xyz")
MOMENTS = tuple(f"moment_{axis}_Nm" for axis in "xyz")

ABOUT = About(
    id="zero_level",
    entry=Entry(
        "`plate_k`",
        "not tared, or under load: a constant force and moment (about the plate's middle) in all it reads",
        "`force_x_N`, `force_y_N`, `force_z_N`, `moment_x_Nm`, `moment_y_Nm`, `moment_z_Nm`",
    ),
    title="wrong zero level of {target}",
    sentence="{target} was not tared, or something stood on it when it was: a constant is in all it reads.",
    remedy="Tare the plate with nobody on it, or take off what it reads while it is empty.",
    told_apart_by="a second of recording with nobody on the plate, before and after the trial",
    branch="plate/zero",
    names=Named.PLATES,
    odds_against=2.0,
    sizes=(Size("force_y_N", 100.0, 1000.0, 10000.0, "not tared, or under load; a plate's range at most"),),
    readings=(
        Reading("force_y_N", "it reads {amount} too {which} along y", "N", which=("much", "little")),
        *along("force_{}_N", "{{amount}} too far towards {{which}}", "N", axes="xz"),
        *along("moment_{}_Nm", "{{amount}} too much about its middle's {{which}}", "N·m"),
    ),
    picture=Plates(),
)


@dataclass(frozen=True)
class ZeroLevel(Candidate):
    """recorded = true + a constant force and moment about the plate's middle, while it is loaded."""

    about = ABOUT

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Less a newton along, and a newton metre about, each axis at the middle."""
        plate = next((p for p in scene.plates if p.target == self.target and p.loads.carrying.any()), None)
        if plate is None:
            return None
        share = np.nan_to_num(plate.at_frames(plate.loads.carrying.astype(float)))
        forces = force_at(np.eye(3), np.tile(plate.centre_ground, (3, 1)))
        moments = np.concatenate([np.zeros((3, 3)), np.eye(3)], axis=1)
        constant = np.concatenate([forces, moments]).T
        prior_std = PRIOR_STD_N * np.repeat([1.0, LEVER_M], 3)
        return Signature(-share[:, None, None] * constant, prior_std)

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "6"],
        covariance: Float[np.ndarray, "6 6"],
    ) -> dict[str, Estimate]:
        """force_x_N, force_y_N, force_z_N, and moments about the plate's middle likewise."""
        std = np.sqrt(np.diag(covariance))
        return {n: Estimate(float(x[k]), float(std[k])) for k, n in enumerate((*FORCES, *MOMENTS))}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """A force or a moment beyond what a tared plate drifts."""
        forces = [estimates[name].value for name in FORCES]
        moments = [estimates[name].value / LEVER_M for name in MOMENTS]
        return float(np.linalg.norm([*forces, *moments])) > LEAST_N


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One for each plate that somebody is on and that is never seen empty."""
    empty = {p.target for scene in scenes for p in scene.plates if p.seen_empty}
    return [ZeroLevel(target) for target in loaded_plates(scenes) if target not in empty]
