"""The learnt part of suggestions: a multinomial model of window features, and the smoothing over time.

What a window of two seconds looks like in a few numbers of about one, which the learnt weights weigh.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from solver.common.gravity import GRAVITY
from solver.gait.activity import LEARNT, Activity
from solver.gait.body_motion import BodyMotion

LEAST_SHARE = 0.02  # no window speaks against an activity more than fifty to one
SURE_SHARE = 0.9  # of a window of 2 s, whose word a change of activity costs; less would flicker

NAMES = (
    "pace",  # over the surface, of √(g L); 0.7 where people begin to run
    "step rate",  # contacts of both feet, of 3 a second
    "flight",  # share of the time with no foot on the ground
    "double support",  # share with both
    "pelvis travel up and down",  # of L, a quarter
    "vertical speed",  # RMS of the pelvis, of 0.3 √(g L)
    "weightless",  # share of the time in which the pelvis falls with more than 0.7 g
    "landing",  # largest upward acceleration of the pelvis, of 3 g
    "both feet up",  # height of the lower sole over where it stands, of L, a fifth
    "knees bent",  # most that both are at once, of 90°
    "knees apart",  # mean difference of flexion, of 30°
    "step",  # most that a heel is before the other, of L
)

FILE = "activity_weights.json"  # made by `python -m benchmarks.activities --learn`
WINDOW_S = 2.0  # [s] about two strides of a walk, one squat
HOP_S = 0.5  # [s] borders of stretches are no sharper than a step


@dataclass(frozen=True)
class Windows:
    """Windows of a trial: each stands for the frames about its middle."""

    spans: tuple[tuple[int, int], ...]  # frames that it looks at
    cells: tuple[tuple[int, int], ...]  # frames that it speaks for; together the trial, without overlap


def windows_of(motion: BodyMotion) -> Windows:
    """Windows at equal distances; one that is as long as the trial where that is shorter.

    Args:
        motion: of the trial.
    """
    frames = motion.frames
    hop = max(1, round(HOP_S * motion.rate))
    length = min(frames, max(2, round(WINDOW_S * motion.rate)))
    count = max(1, round(frames / hop))
    borders = np.linspace(0, frames, count + 1).round().astype(int)
    cells = tuple((int(a), int(b)) for a, b in pairwise(borders))
    starts = [min(max(0, (a + b - length) // 2), frames - length) for a, b in cells]
    return Windows(tuple((start, start + length) for start in starts), cells)


def features_of(motion: BodyMotion, span: tuple[int, int]) -> Float[np.ndarray, " features"]:
    """The numbers of one window, in the order of `NAMES`.

    Args:
        motion: of the trial.
        span: the window's frames.
    """
    part = slice(*span)
    seconds = (span[1] - span[0]) / motion.rate
    leg, swift = motion.leg, np.sqrt(GRAVITY * motion.leg)
    standing = motion.stands[part].sum(axis=1)
    begin, end = motion.times[span[0]], motion.times[span[1] - 1]
    contacts = sum(s.contact_s is not None and begin <= s.contact_s <= end for s in motion.stances)
    lift = motion.soles[part] - motion.ground
    knees = motion.knees[part]
    upward = motion.acceleration[part, 1]
    numbers = (
        motion.pace[part].mean() / swift,
        contacts / seconds / 3,
        (standing == 0).mean(),
        (standing == 2).mean(),
        np.ptp(motion.pelvis[part, 1]) / (0.25 * leg),
        np.sqrt(np.mean(motion.velocity[part, 1] ** 2)) / (0.3 * swift),
        (upward < -0.7 * GRAVITY).mean(),
        upward.max() / (3 * GRAVITY),
        max(0.0, lift.min(axis=1).max()) / (0.2 * leg),
        knees.min(axis=1).max() / np.radians(90),
        np.abs(knees[:, 0] - knees[:, 1]).mean() / np.radians(30),
        motion.ahead[part].max() / leg,
    )
    return np.clip(np.array(numbers), -MOST_FEATURE_VALUE, MOST_FEATURE_VALUE)


MOST_FEATURE_VALUE = 2.0  # of any number: beyond, more says no more


@dataclass(frozen=True)
class Weights:
    """log p(class | features) = weights · features + bias, less what makes the sum one."""

    weights: Float[np.ndarray, "classes features"]  # classes in the order of `LEARNT`
    bias: Float[np.ndarray, " classes"]


@cache
def learnt_weights() -> Weights:
    """Those of the package."""
    stored = json.loads(files("solver.gait").joinpath(FILE).read_text(encoding="utf-8"))
    classes = stored["classes"]
    return Weights(
        np.array([[classes[name]["weights"][feature] for feature in NAMES] for name in LEARNT]),
        np.array([classes[name]["bias"] for name in LEARNT]),
    )


def shares(
    weights: Weights, features: Float[np.ndarray, "windows features"]
) -> Float[np.ndarray, "windows classes"]:
    """Probability of each learnt class in each window.

    Args:
        weights: of the model.
        features: of the windows.
    """
    scores = features @ weights.weights.T + weights.bias
    odds = np.exp(scores - scores.max(axis=1, keepdims=True))
    return odds / odds.sum(axis=1, keepdims=True)


def smooth_probabilities(probabilities: Float[np.ndarray, "windows classes"]) -> Int[np.ndarray, " windows"]:
    """The likeliest classes over time, by Viterbi: a change costs what 2 s say that are nine tenths sure.

    Args:
        probabilities: of each window.
    """
    overlap = WINDOW_S / HOP_S  # windows that look at the same frames
    evidence = np.log(np.clip(probabilities, LEAST_SHARE, 1.0)) / overlap
    change = np.log(SURE_SHARE / (1 - SURE_SHARE))
    best, came = evidence[0], []
    for now in evidence[1:]:
        stay_or_change = np.maximum(best, best.max() - change)
        came.append(np.where(best >= best.max() - change, np.arange(len(best)), best.argmax()))
        best = stay_or_change + now
    time_history = [int(best.argmax())]
    for back in reversed(came):
        time_history.append(int(back[time_history[-1]]))
    return np.array(time_history[::-1])


def all_classes() -> tuple[Activity, ...]:
    """The learnt classes first, then those that keep hand thresholds."""
    return (*LEARNT, *(activity for activity in Activity if activity not in LEARNT))
