"""Gravity tilt: the plates' vertical is not the cameras' vertical."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, Entry
from solver.diagnosis.causes.changed_force import wrench_change
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene
from solver.skeleton.forward import cross

PRIOR_STD_RAD = np.radians(1.0)  # a calibration frame on an uneven floor
LEAST_DEG = 0.5
TILTS = ("tilt_x_deg", "tilt_z_deg")


ABOUT = About(
    id="gravity_tilt",
    entry=Entry(
        "`all`",
        "force vectors turned by a small rotation about x and z",
        "`tilt_x_deg`, `tilt_z_deg`",
    ),
    title="tilted force vectors",
    sentence="All forces are tilted: the vertical of the force plates is not that of the cameras.",
    remedy=(
        "Level the calibration frame, and check that the plates stand level; calibrate the cameras again."
    ),
    told_apart_by="a quiet standing trial, and a weight set down on each plate",
    branch="plate/geometry",
    asked_up_to=10.0,
    readings=(
        Reading("tilt_x_deg", "the recorded forces are turned by {amount} about +x (right-hand rule)", "°"),
        Reading("tilt_z_deg", "the recorded forces are turned by {amount} about +z (right-hand rule)", "°"),
    ),
)


@dataclass(frozen=True)
class GravityTilt(Candidate):
    """recorded force vectors = R(rotation vector (tilt_x, 0, tilt_z)) × true; centres of pressure stay.

    To first order true − recorded force = −tilt × recorded force, at the centre of pressure.
    """

    about = ABOUT

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """All plates' forces turned back about x and about z."""
        if not any(plate.loaded.any() for plate in scene.plates):
            return None
        columns = np.zeros((scene.frames, 6, 2))
        for plate in scene.plates:
            for k, axis in enumerate(np.eye(3)[[0, 2]]):
                columns[:, :, k] += wrench_change(plate, -cross(axis, plate.loads.wrench_ground[:, :3]))
        return Signature(columns, np.full(2, PRIOR_STD_RAD))

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "2"],
        covariance: Float[np.ndarray, "2 2"],
    ) -> dict[str, Estimate]:
        """tilt_x_deg, tilt_z_deg: components of the rotation vector."""
        value, std = np.degrees(x), np.degrees(np.sqrt(np.diag(covariance)))
        return {name: Estimate(float(value[k]), float(std[k])) for k, name in enumerate(TILTS)}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what levels on a floor scatter."""
        return float(np.linalg.norm([estimates[name].value for name in TILTS])) > LEAST_DEG


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One vertical for all plates."""
    loaded = any(plate.loaded.any() for scene in scenes for plate in scene.plates)
    return [GravityTilt("all")] if loaded else []
