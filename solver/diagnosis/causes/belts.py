"""A belt, ramp or platform under the person: it speeds up and slows down, or slopes unseen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.gravity import GRAVITY
from solver.diagnosis.causes.about import About, AtFault, Entry, Reading, TimeHistory
from solver.diagnosis.causes.effect import (
    Candidate,
    Estimate,
    Eta,
    Fitted,
    InPieces,
    InTrials,
    Nonlinear,
    Range,
    Signature,
    all_and_each,
)
from solver.diagnosis.causes.observed_trial import Scene, force_at
from solver.diagnosis.causes.time_history import Stretch, stretch_of
from solver.dynamics.root_wrench import about_point

KNOTS_S = 0.08  # a belt's drive answers each foot's landing
MOST_KNOTS = 1000  # of one trial: a balance has four hundred windows, which a finer history meets alone
MOST_VALUES = 8_000_000  # of columns that are held at a time
PRIOR_STD_M_PER_S2 = 0.5
CONSTANT_SHARE = 0.1  # of the prior: 0.05 m/s² on average
TIME_HISTORY_STD = 0.08  # of the RMS: what is too quick for its splines; by hidden effects
MOST_ASIDE_RAD = 0.6  # nothing drives a belt across: what shakes a person sideways is another cause
FEWEST_M = 0.3  # a person who travels less than that in a trial has no direction of progression
PRIOR_STD_DEG = 10.0
LEAST_DEG = 4.0  # 7 %; less is a vertical out of level (`gravity_tilt`)
MOST_DEG = 25.0  # no treadmill or ramp is steeper
HEIGHT_STD_M = 0.3  # of the belt under the person, above where the forces have it
ALONG_STD_M = 0.1

OF_ALL, OF_FORCES = "markers_and_forces", "all_forces"


@dataclass(frozen=True)
class BeltAcceleration(InPieces):
    """In the frame of a support that accelerates by a every particle feels −m a: −M a at the centre of mass.

    There is no moment about the centre of mass, which tells it from a contact. η is the direction of a, an
    angle about +y from the trial's progression [rad].
    """

    time_histories: tuple[Stretch, ...] = ()  # whole trials, each with parameters of its own

    about = About(
        id="belt_acceleration",
        entry=Entry("`all`", "belt or platform accelerates", "`rms_m_per_s2`"),
        title="a belt or platform that accelerates, if there was one",
        sentence=("If the person walked or stood on a belt or platform: it speeds up and slows down."),
        remedy=(
            "On a treadmill or a moving platform: record its speed, and use a stiffer drive. On solid "
            "ground do not accept this: something else is wrong with the horizontal forces, so check "
            "those channels."
        ),
        separate_by="a marker on the belt or on the platform",
        branch="ground/belt or platform",
        at_fault=AtFault.MOVEMENT,
        time_history=TimeHistory.ALL_ALONG,
        odds_against=3.0,
        readings=(Reading("rms_m_per_s2", "{amount} (root mean square)", "m/s²"),),
    )
    nonlinear = (
        # along the progression, as far as that is known
        Nonlinear("direction", (0.0,), step=0.2, bounds=(-MOST_ASIDE_RAD, MOST_ASIDE_RAD), prior=(0.0, 0.3)),
    )
    least = 0.15  # [m/s²] RMS; a good treadmill keeps below, and soft tissue looks like 0.12

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Splines of a(t) in this trial; zero for those of other trials."""
        if scene.name not in {c.trial for c in self.time_histories}:
            return
        angle = progression(scene) + eta[0]
        whole = force_at(
            -scene.skeleton.mass * np.array([np.cos(angle), 0.0, -np.sin(angle)]), scene.com_ground
        )
        each = max(1, MOST_VALUES // whole.size)
        for c in self.time_histories:
            time_histories = _TimeHistories(c)
            for first in range(0, time_histories.count, each):
                some = slice(first, min(first + each, time_histories.count))
                prior_std = np.full(some.stop - some.start, PRIOR_STD_M_PER_S2)
                if c.trial == scene.name:
                    columns = whole[:, :, None] * time_histories.some(some)[:, None]
                else:
                    columns = np.zeros((*whole.shape, len(prior_std)))
                yield Signature(columns, prior_std)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """rms_m_per_s2 over all frames."""
        gram, frames = np.zeros((len(fit.x), len(fit.x))), 0
        first = 0
        for c in self.time_histories:
            time_histories = _TimeHistories(c)
            own = slice(first, first + time_histories.count)
            gram[own, own] = time_histories.gram()
            first, frames = own.stop, frames + c.frames
        gram /= frames
        rms = float(np.sqrt(fit.x @ gram @ fit.x))
        slope = gram @ fit.x / max(rms, 1e-9)
        variance = float(slope @ fit.covariance @ slope) + (TIME_HISTORY_STD * rms) ** 2
        return {"rms_m_per_s2": Estimate(rms, float(np.sqrt(variance)))}

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """All frames of its trials."""
        return tuple(Range(c.trial, 0, c.frames) for c in self.time_histories)

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One support, in all trials and in each alone: an uneven drive may be switched on for one."""
        time_histories = [stretch_of(s, 0, s.frames) for s in scenes]
        of_trials = (
            [time_histories, *([c] for c in time_histories)] if len(time_histories) > 1 else [time_histories]
        )
        return [cls("all", tuple(some)) for some in of_trials if some]


class _TimeHistories:
    """Splines of mean zero, and a small constant: nothing goes on speeding up in a laboratory."""

    def __init__(self, stretch: Stretch) -> None:
        self._humps = stretch.sparse_humps(max(KNOTS_S, stretch.seconds / MOST_KNOTS))
        self._means = np.asarray(self._humps.mean(axis=0))
        self.count = len(self._means) + 1

    def some(self, which: slice) -> Float[np.ndarray, "frames time histories"]:
        """Those of a range."""
        time_histories = self._humps[:, which].toarray() - self._means[which]
        if which.stop < self.count:
            return np.asarray(time_histories)
        return np.concatenate([time_histories, np.full((len(time_histories), 1), CONSTANT_SHARE)], axis=1)

    def gram(self) -> Float[np.ndarray, "time histories time histories"]:
        """Their products with each other, summed over frames: zero of the constant with the others."""
        frames, n = self._humps.shape[0], self.count - 1
        found = np.zeros((self.count, self.count))
        found[:n, :n] = (self._humps.T @ self._humps).toarray()
        found[:n, :n] -= frames * np.outer(self._means, self._means)
        found[n, n] = frames * CONSTANT_SHARE**2
        return found


def progression(scene: Scene) -> float:
    """The way that the person goes over the support, an angle about +y from +x [rad].

    From the centre of mass where it travels; else from the feet, which a belt carries back while they stand.
    """
    travelled = scene.com_ground[-1] - scene.com_ground[0]
    if np.hypot(travelled[0], travelled[2]) < FEWEST_M:
        travelled = _against_the_belt(scene)
    return float(np.arctan2(-travelled[2], travelled[0]))


def _against_the_belt(scene: Scene) -> Float[np.ndarray, "3"]:
    """Opposite to the mean velocity of feet while plates carry them, times the trial's duration [m]."""
    travelled = np.zeros(3)
    for sole in scene.soles:
        part = sole.parts[0]
        velocity = scene.point_velocity_ground(part.body, part.corners_body.mean(axis=0))
        standing = scene.contacts.in_contact[:, scene.contacts.foot_bodies.index(sole.foot_body)]
        travelled -= velocity[standing].sum(axis=0) / scene.rate
    return travelled if np.hypot(travelled[0], travelled[2]) > FEWEST_M else np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class BeltSlope(InTrials):
    """recorded = R(lateral axis, −slope) true: of the forces' wrenches, or of everything but gravity.

    η is the slope [rad]. Of forces alone, how high the belt is where feet press on average, and where along
    it, is two linear parameters.
    """

    about = About(
        id="belt_slope",
        entry=Entry(
            "`markers_and_forces`, `all_forces`",
            "markers and forces, or forces alone, in axes of a sloping belt or ramp: recorded = true "
            "turned by −slope about the lateral axis; positive: uphill",
            "`slope_deg`",
        ),
        title="a slope of the belt that is missing in {target}",
        sentence="The belt or ramp slopes, and {target} are given as if it were level.",
        remedy=(
            "Turn what is in the belt's axes by the slope about the lateral axis when the files are "
            "exported, so that the vertical of markers and forces is that of a plumb line."
        ),
        separate_by="a plumb line in the cameras' view; somebody who stands still on the sloping belt",
        branch="ground/belt or platform",
        readings=(Reading("slope_deg", "it goes {which} by {amount}", "°", which=("uphill", "downhill")),),
        targets={OF_ALL: "markers and forces", OF_FORCES: "the forces"},
    )

    nonlinear = (
        Nonlinear(
            "slope",
            tuple(float(np.radians(slope)) for slope in (-15.0, -10.0, -6.0, 6.0, 10.0, 15.0)),
            step=float(np.radians(1.0)),
            bounds=(-float(np.radians(MOST_DEG)), float(np.radians(MOST_DEG))),
            prior=(0.0, float(np.radians(PRIOR_STD_DEG))),
        ),
    )

    def admissible(self, eta: Eta) -> bool:
        """Steeper than a floor out of level, and no steeper than a ramp."""
        return abs(np.degrees(eta[0])) >= LEAST_DEG and super().admissible(eta)

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
            return Signature.of_fixed(fixed)
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

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """slope_deg; positive where the person goes uphill."""
        return {"slope_deg": Estimate(float(np.degrees(fit.eta[0])), float(np.degrees(fit.eta_std[0])))}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """More than a floor or a calibration out of level."""
        return abs(estimates["slope_deg"].value) >= LEAST_DEG

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One slope, in all trials or in one, of all files or of the forces."""
        if not any(plate.loaded.any() for scene in scenes for plate in scene.plates):
            return []
        return [cls(target, trial) for target in (OF_ALL, OF_FORCES) for trial in all_and_each(scenes)]
