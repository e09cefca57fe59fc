"""Recorded walks and runs whose feet are hidden for a while: the hider knows the events.

Some or all markers of a foot are taken away for 0.03 to 0.6 s, and what is left is tracked anew.
"""

import pickle
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.activities.recorded import KNOWN, recorded
from benchmarks.gait_events import EDGE_S, Told, harm
from benchmarks.gait_over_plates import verdict_on
from solver.capture.force_settings import CONDITIONING
from solver.fit import TrialFit
from solver.gait.activity import Activity
from solver.gait.gait import gait_of
from solver.gait.settings import GAIT
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.motion import Motion
from solver.settings import Settings
from solver.skeleton.forward import marker_positions
from solver.skeleton.skeleton import Skeleton

HIDDEN_S = (0.03, 0.6)  # longest and shortest are as likely, by their logarithms
APART_S = 0.8  # from one to the next of a foot
NEAR_S = 0.15  # beside a hidden stretch: farther, events are as they were
ROUNDS = 2  # of every recording, otherwise hidden
LONGEST = 1000  # frames; of a longer recording the middle ones
SEED = 5


@dataclass(frozen=True, eq=False)
class Hidden:
    """One recording, otherwise tracked, and what is known of it."""

    person: str
    skeleton: Skeleton
    trial: TrialFit
    truth: list[Told]
    near: Bool[np.ndarray, "frames feet"]  # where events may be others

    def told(self) -> list[Told]:
        """Events with the constants as they are in this process, near what is hidden."""
        return self._near(_events(self.trial, self.skeleton))

    def harm(self, told: Sequence[Told]) -> float:
        """As of plates."""
        end_s = float(self.trial.motion.times[-1])
        return harm(verdict_on(self._near(self.truth), told, end_s))

    def _near(self, events: list[Told]) -> list[Told]:
        assert self.trial.contacts is not None
        feet = list(self.trial.contacts.foot_bodies)
        times = self.trial.motion.times
        return [e for e in events if self.near[np.abs(times - e.time_s).argmin(), feet.index(e.foot)]]


def _events(trial: TrialFit, skeleton: Skeleton) -> list[Told]:
    gait = gait_of(trial, skeleton, GAIT, CONDITIONING, feet_alone=True)
    assert gait is not None
    return [Told(gait.feet[e.foot], e.kind.value, e.time_s) for e in gait.events]


@cache
def hidden(kept: Path) -> tuple[Hidden, ...]:
    """All walks and runs; what was tracked is kept in a folder.

    Args:
        kept: in which fits of the recordings are, too.
    """
    file = kept / "hidden.pickle"
    if not file.exists():
        file.write_bytes(pickle.dumps(list(_made(kept))))
    return tuple(pickle.loads(file.read_bytes()))


def _made(kept: Path) -> Iterator[Hidden]:
    list(recorded(kept / "rec"))  # so that their fits are there
    rng = np.random.default_rng(SEED)
    for folder, name in dict.fromkeys(
        (k.folder, k.trial) for k in KNOWN if k.activity in (Activity.WALKING, Activity.RUNNING)
    ):
        fits = pickle.loads((kept / "rec" / f"{folder.replace('/', '__')}.pickle").read_bytes())
        skeleton, trial, _ = fits[name]
        observed = _observed(trial)
        whole = _tracked(skeleton, trial, observed)
        truth = _events(whole, skeleton)
        for _ in range(ROUNDS):
            left, near = hide(skeleton, trial.contacts.foot_bodies, observed, trial.motion.rate, rng)
            yield Hidden(folder, skeleton, _tracked(skeleton, trial, left), truth, near)


def _observed(trial: TrialFit) -> Float[np.ndarray, "frames markers 3"]:
    """Of the markers of the model, the middle of the recording."""
    markers = trial.capture.markers
    found = np.full((markers.frames, len(trial.marker_errors.names), 3), np.nan)
    for k, name in enumerate(trial.marker_errors.names):
        if name in markers.names:
            found[:, k] = markers.positions_ground[:, markers.names.index(name)]
    first = max(0, (markers.frames - LONGEST) // 2)
    return found[first : first + LONGEST]


def _tracked(
    skeleton: Skeleton, trial: TrialFit, observed: Float[np.ndarray, "frames markers 3"]
) -> TrialFit:
    """The trial by other markers; times begin with them."""
    rate = trial.motion.rate
    q = inverse_kinematics(skeleton, observed, rate, Settings().kinematics)
    distance = np.linalg.norm(marker_positions(skeleton, q) - observed, axis=2)
    return replace(
        trial,
        motion=Motion(skeleton.dofs, q, rate),
        marker_errors=replace(trial.marker_errors, distance=distance),
        kinematics_only=None,
    )


def hide(
    skeleton: Skeleton,
    feet: Sequence[str],
    observed: Float[np.ndarray, "frames markers 3"],
    rate: float,
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "frames markers 3"], Bool[np.ndarray, "frames feet"]]:
    """Take markers of both feet away now and then.

    Args:
        skeleton: whose markers are observed, in this order.
        feet: names of their bodies.
        observed: markers, NaN where unseen [m].
        rate: [Hz].
        rng: of when, how long and which.

    Returns:
        Markers that are left [m], and where a foot is near to what was taken.
    """
    left = observed.copy()
    near = np.zeros((len(left), len(feet)), dtype=bool)
    for k, foot in enumerate(map(skeleton.body_index, feet)):
        worn = np.flatnonzero(np.isfinite(left[..., 0]).any(axis=0))
        own = [m for m in worn if _on_foot(skeleton, skeleton.markers[m].body, foot)]
        begin = float(rng.uniform(EDGE_S, APART_S))
        while begin < len(left) / rate - APART_S / 2:
            lasts = float(np.exp(rng.uniform(*np.log(HIDDEN_S))))
            gone = rng.permutation(own)[: int(rng.integers(1, len(own) + 1))]
            left[round(begin * rate) : round((begin + lasts) * rate), gone] = np.nan
            near[max(0, round((begin - NEAR_S) * rate)) : round((begin + lasts + NEAR_S) * rate), k] = True
            begin += lasts + APART_S * float(rng.uniform(0.5, 1.5))
    return left, near


def _on_foot(skeleton: Skeleton, body: int, foot: int) -> bool:
    """Whether a body is a foot or its toes."""
    return foot in (body, skeleton.joints[body].parent)


def told_of_hidden(kept: str) -> list[list[tuple[str, str, float]]]:
    """Events of every recording in this process, with the constants as they are here."""
    return [[(e.foot, e.kind, e.time_s) for e in one.told()] for one in hidden(Path(kept))]
