"""Belt slope: a treadmill or ramp slopes, and files are in axes of the belt, as if it were level.

The forces alone, where cameras were calibrated with a level frame; or markers and forces, if on the belt.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.gravity import GRAVITY
from solver.diagnosis.causes.about import About, Entry
from solver.diagnosis.causes.belt_acceleration import progression
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, InTrials, Signature, all_and_each
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene, force_at
from solver.dynamics.root_wrench import about_point

STARTS_DEG = (-15.0, -10.0, -6.0, 6.0, 10.0, 15.0)
PRIOR_STD_DEG = 10.0
LEAST_DEG = 4.0  # 7 %; less is a vertical out of level (`gravity_tilt`)
MOST_DEG = 25.0  # no treadmill or ramp is steeper
HEIGHT_STD_M = 0.3  # of the belt under the person, above where the forces have it
ALONG_STD_M = 0.1

OF_ALL, OF_FORCES = "markers_and_forces", "all_forces"

ABOUT = About(
    id="belt_slope",
    entry=Entry(
        "`markers_and_forces`, `all_forces`",
        "markers and forces, or forces alone, in axes of a sloping belt or ramp: recorded = true turned by "
        "−slope about the lateral axis; positive: uphill",
        "`slope_deg`",
    ),
    title="a slope of the belt that is missing in {target}",
    sentence="The belt or ramp slopes, and {target} are given as if it were level.",
    remedy=(
        "Turn what is in the belt's axes by the slope about the lateral axis when the files are "
        "exported, so that the vertical of markers and forces is that of a plumb line."
    ),
    told_apart_by="a plumb line in the cameras' view; somebody who stands still on the sloping belt",
    branch="ground/belt or platform",
    readings=(Reading("slope_deg", "it goes {which} by {amount}", "°", which=("uphill", "downhill")),),
    targets={OF_ALL: "markers and forces", OF_FORCES: "the forces"},
)


@dataclass(frozen=True)
class BeltSlope(InTrials):
    """recorded = R(lateral axis, −slope) true: of the forces' wrenches, or of everything but gravity.

    η is the slope [rad]. Of forces alone, how high the belt is where feet press on average, and where along
    it, is two linear parameters.
    """

    about = ABOUT

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Slopes of treadmills and ramps, up and down [rad]."""
        return tuple((float(np.radians(slope)),) for slope in STARTS_DEG)

    def steps(self) -> Eta:
        """[rad]."""
        return (float(np.radians(1.0)),)

    def prior(self, scenes: Sequence[Scene]) -> tuple[tuple[float, float], ...]:
        """Up and down alike."""
        return ((0.0, float(np.radians(PRIOR_STD_DEG))),)

    def admissible(self, eta: Eta) -> bool:
        """Steeper than a floor out of level."""
        return LEAST_DEG <= abs(np.degrees(eta[0])) <= MOST_DEG

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Gravity along the belt; or all wrenches turned, and per metre that they act higher, farther on."""
        recorded = scene.measured_ground
        if self.trial not in (None, scene.name) or not recorded[:, 1].any():
            return None
        angle = progression(scene)
        ahead, upwards = np.array([np.cos(angle), 0.0, -np.sin(angle)]), np.array([0.0, 1.0, 0.0])
        level = np.stack([ahead, upwards, np.cross(ahead, upwards)])
        c, s = np.cos(eta[0]), np.sin(eta[0])
        if self.target == OF_ALL:
            along = scene.skeleton.mass * GRAVITY * (s * ahead + (c - 1.0) * upwards)
            fixed = -force_at(along, scene.com_ground)
            return Signature(np.zeros((scene.frames, 6, 0)), np.zeros(0), fixed)
        R = level.T @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ level
        up = recorded[:, 1]
        middle = np.array([up @ recorded[:, 5], 0.0, -(up @ recorded[:, 3])]) / (up @ up)
        place = np.broadcast_to(middle, recorded[:, :3].shape)
        own = about_point(recorded, place)
        turned = about_point(np.concatenate([own[:, :3] @ R.T, own[:, 3:] @ R.T], axis=1), -place)
        nothing = np.zeros_like(place)
        levers = [np.concatenate([nothing, np.cross(way, turned[:, :3])], axis=1) for way in (upwards, ahead)]
        stds = np.array([HEIGHT_STD_M, ALONG_STD_M])
        return Signature(np.stack(levers, axis=2), stds, turned - recorded)

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, " parameters"],
        covariance: Float[np.ndarray, "parameters parameters"],
    ) -> dict[str, Estimate]:
        """slope_deg; positive where the person goes uphill."""
        return {"slope_deg": Estimate(float(np.degrees(eta[0])), float(np.degrees(eta_std[0])))}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """More than a floor or a calibration out of level."""
        return abs(estimates["slope_deg"].value) >= LEAST_DEG


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One slope, in all trials or in one, of all files or of the forces."""
    if not any(plate.loaded.any() for scene in scenes for plate in scene.plates):
        return []
    return [BeltSlope(target, trial) for target in (OF_ALL, OF_FORCES) for trial in all_and_each(scenes)]
