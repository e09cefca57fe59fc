"""Where plates lie and how they are turned, a little off what the laboratory's files say."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.diagnosis.causes.about import About, Entry, Named, Plates, Reading, Size, along
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, OfOnePlate, Signature
from solver.diagnosis.causes.gross_cause import wrench_change
from solver.diagnosis.causes.observed_trial import PlateScene, Scene, loaded_plates, moments_aside
from solver.skeleton.forward import cross

PLACE_STD_M = 0.01  # a calibration wand misplaced, a corner clicked beside the corner: 1 to 20 mm
GROSS_STD_M = 0.15  # another plate's corners, a wrong origin: a plate's side and more
GROSS_ODDS = 3.5  # [nats] against that: 1 in 30
YAW_STD_RAD = np.radians(4.0)  # corners clicked a centimetre beside the corner, or from an old drawing
TILT_STD_RAD = np.radians(1.0)  # a calibration frame on an uneven floor
UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class PlatePosition(OfOnePlate):
    """recorded − true centre of pressure = shift, in the floor; exact at any size.

    Force and free moment stay, so true − recorded moment = −shift × force.
    """

    prior_std_m: float = PLACE_STD_M

    about = About(
        id="plate_position",
        entry=Entry("`plate_k`", "recorded − true centre of pressure", "`shift_x_m`, `shift_z_m`"),
        title="wrong position of {target}",
        sentence="{target} is not exactly where the files place it.",
        remedy=(
            "Measure the plate's corners again, with a pointer or markers on them, after each camera "
            "calibration."
        ),
        separate_by="a pointed rod pressed on the plate at several known places",
        branch="plate/geometry",
        names=Named.PLATES,
        usual_std=0.001,
        asked_up_to=60.0,
        sizes=(
            Size("shift_x_m", 0.008, 0.03, 0.3, "half a plate's side at most; beyond, its geometry is wrong"),
        ),
        readings=along(
            "shift_{}_m", "the files place it {{amount}} too far towards {{which}}", "mm", 1e3, axes="xz"
        ),
        picture=Plates(shift="shift_{}_m"),
    )
    parameters = ("shift_x_m", "shift_z_m")
    least = 0.005  # [m] half of what spends the limit on residual moments

    @property
    def place_odds(self) -> float:
        """Plates in another place altogether are rarer."""
        return 0.0 if self.prior_std_m == PLACE_STD_M else GROSS_ODDS

    def of_plate(self, plate: PlateScene, scene: Scene, eta: Eta) -> Signature:
        """Moments alone: the plate's force times the shift along x and z."""
        return Signature(-moments_aside(plate.wrench_ground[:, :3]), np.full(2, self.prior_std_m))

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """For each plate a little beside its place, and far from it."""
        return [cls(target, std) for target in loaded_plates(scenes) for std in (PLACE_STD_M, GROSS_STD_M)]


@dataclass(frozen=True)
class PlateYaw(OfOnePlate):
    """recorded force and centre of pressure = R_y(yaw) × true about the plate's centre, right hand about +y.

    Linear in x = sin(yaw): force and moment about the centre turn back by −x (y × ·). What is left out,
    (1 − cos(yaw)) of the horizontal parts, is a fortieth of the effect at 3 degrees.
    """

    about = About(
        id="plate_yaw",
        entry=Entry(
            "`plate_k`",
            "recorded force and centre of pressure turned about the vertical through the plate's centre",
            "`yaw_deg`",
        ),
        title="{target} turned about the vertical",
        sentence="{target} is turned about the vertical relative to the axes in the files.",
        remedy="Measure the plate's corners again and check their order in the files.",
        separate_by="a pointed rod pressed on the plate near its corners",
        branch="plate/geometry",
        names=Named.PLATES,
        odds_against=-2.0,
        asked_up_to=15.0,
        readings=(
            Reading(
                "yaw_deg",
                "what was recorded is turned by {amount} {which} about the plate's centre",
                "°",
                which=(
                    (
                        "counter-clockwise, seen from above: turn its forces and centres of pressure back "
                        "clockwise"
                    ),
                    (
                        "clockwise, seen from above: turn its forces and centres of pressure back "
                        "counter-clockwise"
                    ),
                ),
            ),
        ),
        picture=Plates(yaw="yaw_deg"),
    )
    least = 1.0  # [°] what careful calibrations scatter

    def of_plate(self, plate: PlateScene, scene: Scene, eta: Eta) -> Signature:
        """Horizontal force and horizontal moment about the centre, each turned by a right angle."""
        force, moment = plate.wrench_ground[:, :3], plate.wrench_ground[:, 3:]
        force_back = -cross(UP, force)
        about_centre_back = -cross(UP, moment - cross(plate.centre_ground, force))
        moment_back = about_centre_back + cross(plate.centre_ground, force_back)
        column = np.concatenate([force_back, moment_back], axis=1)
        return Signature(column[:, :, None], np.array([YAW_STD_RAD]))

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """yaw_deg."""
        sine = float(np.clip(fit.x[0], -0.99, 0.99))
        std = float(np.sqrt(fit.covariance[0, 0])) / np.sqrt(1 - sine**2)
        return {"yaw_deg": Estimate(float(np.degrees(np.arcsin(sine))), float(np.degrees(std)))}


@dataclass(frozen=True)
class GravityTilt(Candidate):
    """recorded force vectors = R(rotation vector (tilt_x, 0, tilt_z)) × true; centres of pressure stay.

    To first order true − recorded force = −tilt × recorded force, at the centre of pressure.
    """

    about = About(
        id="gravity_tilt",
        entry=Entry(
            "`all`", "force vectors turned by a small rotation about x and z", "`tilt_x_deg`, `tilt_z_deg`"
        ),
        title="tilted force vectors",
        sentence="All forces are tilted: the vertical of the force plates is not that of the cameras.",
        remedy=(
            "Level the calibration frame, and check that the plates stand level; calibrate the cameras again."
        ),
        separate_by="a quiet standing trial, and a weight set down on each plate",
        branch="plate/geometry",
        asked_up_to=10.0,
        readings=(
            Reading(
                "tilt_x_deg", "the recorded forces are turned by {amount} about +x (right-hand rule)", "°"
            ),
            Reading(
                "tilt_z_deg", "the recorded forces are turned by {amount} about +z (right-hand rule)", "°"
            ),
        ),
    )
    parameters = ("tilt_x_deg", "tilt_z_deg")
    least = 0.5  # [°] what levels on a floor scatter

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """All plates' forces turned back about x and about z."""
        if not any(plate.loaded.any() for plate in scene.plates):
            return None
        columns = np.zeros((scene.frames, 6, 2))
        for plate in scene.plates:
            for k, axis in enumerate(np.eye(3)[[0, 2]]):
                columns[:, :, k] += wrench_change(plate, -cross(axis, plate.loads.wrench_ground[:, :3]))
        return Signature(columns, np.full(2, TILT_STD_RAD))

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """tilt_x_deg, tilt_z_deg: components of the rotation vector."""
        value, std = np.degrees(fit.x), np.degrees(np.sqrt(np.diag(fit.covariance)))
        return {name: Estimate(float(value[k]), float(std[k])) for k, name in enumerate(self.parameters)}
