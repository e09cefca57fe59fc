"""Belt acceleration: the support under the person speeds up and slows down, the cameras' frame with it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, AtFault, Entry, TimeHistory
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, InPieces, Range, Signature
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene, force_at
from solver.diagnosis.causes.time_history import Stretch, stretch_of

KNOTS_S = 0.08  # a belt's drive answers each foot's landing
MOST_KNOTS = (
    1000  # of one trial: the balance has four hundred windows, which a finer time history meets alone
)
MOST_VALUES = 8_000_000  # of columns that are held at a time
PRIOR_STD_M_PER_S2 = 0.5
LEAST_M_PER_S2 = 0.15  # RMS; a good treadmill keeps below, and soft tissue looks like 0.12
CONSTANT_SHARE = 0.1  # of the prior: 0.05 m/s² on average
TIME_HISTORY_STD = 0.08  # of the RMS: what is too quick for its splines; by hidden effects
MOST_ASIDE = 0.6  # [rad]
FEWEST_M = 0.3  # a person who travels less than that in a trial has no direction of progression


ABOUT = About(
    id="belt_acceleration",
    entry=Entry("`all`", "belt or platform accelerates", "`rms_m_per_s2`"),
    title="a belt or platform that accelerates, if there was one",
    sentence=("If the person walked or stood on a belt or platform: it speeds up and slows down."),
    remedy=(
        "On a treadmill or a moving platform: record its speed, and use a stiffer drive. On solid "
        "ground do not accept this: something else is wrong with the horizontal forces, so check "
        "those channels."
    ),
    told_apart_by="a marker on the belt or on the platform",
    branch="ground/belt or platform",
    at_fault=AtFault.MOVEMENT,
    time_history=TimeHistory.ALL_ALONG,
    odds_against=3.0,
    readings=(Reading("rms_m_per_s2", "{amount} (root mean square)", "m/s²"),),
)


@dataclass(frozen=True)
class BeltAcceleration(InPieces):
    """In the frame of a support that accelerates by a every particle feels −m a: −M a at the centre of mass.

    There is no moment about the centre of mass, which tells it from a contact. η is the direction of a, an
    angle about +y from the trial's progression [rad].
    """

    time_histories: tuple[Stretch, ...] = ()  # whole trials, each with parameters of its own

    about = ABOUT

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Along the progression."""
        return ((0.0,),)

    def steps(self) -> Eta:
        """[rad]."""
        return (0.2,)

    def prior(self, scenes: Sequence[Scene]) -> tuple[tuple[float, float], ...]:
        """Along, as far as the progression is known."""
        return ((0.0, 0.3),)

    def admissible(self, eta: Eta) -> bool:
        """Nothing drives a belt across: whatever shakes a person sideways is another cause."""
        return abs(eta[0]) <= MOST_ASIDE

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

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, " parameters"],
        covariance: Float[np.ndarray, "parameters parameters"],
    ) -> dict[str, Estimate]:
        """rms_m_per_s2 over all frames."""
        gram, frames = np.zeros((len(x), len(x))), 0
        first = 0
        for c in self.time_histories:
            time_histories = _TimeHistories(c)
            own = slice(first, first + time_histories.count)
            gram[own, own] = time_histories.gram()
            first, frames = own.stop, frames + c.frames
        gram /= frames
        rms = float(np.sqrt(x @ gram @ x))
        slope = gram @ x / max(rms, 1e-9)
        variance = float(slope @ covariance @ slope) + (TIME_HISTORY_STD * rms) ** 2
        return {"rms_m_per_s2": Estimate(rms, float(np.sqrt(variance)))}

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """All frames of its trials."""
        return tuple(Range(c.trial, 0, c.frames) for c in self.time_histories)

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """More than a good treadmill's unrest."""
        return estimates["rms_m_per_s2"].value > LEAST_M_PER_S2


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


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One support, in all trials and in each alone: an uneven drive may be switched on for one."""
    time_histories = [stretch_of(s, 0, s.frames) for s in scenes]
    of_trials = (
        [time_histories, *([c] for c in time_histories)] if len(time_histories) > 1 else [time_histories]
    )
    return [BeltAcceleration("all", tuple(some)) for some in of_trials if some]
