"""The learnt part of suggestions: a multinomial model of window features, and the smoothing over time."""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from jaxtyping import Float, Int

from solver.gait.activity import LEARNT, Activity
from solver.gait.activity_features import NAMES
from solver.gait.activity_settings import ActivitySettings

FILE = "activity_weights.json"  # made by `python -m benchmarks.activities --learn`


@dataclass(frozen=True)
class Weights:
    """log p(class | features) = weights · features + bias, less what makes the sum one."""

    weights: Float[np.ndarray, "classes features"]  # classes in the order of `LEARNT`
    bias: Float[np.ndarray, " classes"]


@cache
def learnt_weights() -> Weights:
    """Those of the package."""
    told = json.loads(files("solver.gait").joinpath(FILE).read_text(encoding="utf-8"))
    classes = told["classes"]
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


def smoothed(
    probabilities: Float[np.ndarray, "windows classes"], settings: ActivitySettings
) -> Int[np.ndarray, " windows"]:
    """The likeliest classes over time, by Viterbi: a change costs what 2 s say that are nine tenths sure.

    Args:
        probabilities: of each window.
        settings: length and distance of windows, and the shares.
    """
    overlap = settings.window_s / settings.hop_s  # windows that look at the same frames
    evidence = np.log(np.clip(probabilities, settings.least_share, 1.0)) / overlap
    change = np.log(settings.sure_share / (1 - settings.sure_share))
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
