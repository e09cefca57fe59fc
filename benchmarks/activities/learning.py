"""Learns the weights of suggested activities: multinomial logistic regression, by SciPy."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

import solver.gait
from benchmarks.activities.looking import Look
from solver.gait.activity import LEARNT
from solver.gait.activity_features import NAMES
from solver.gait.activity_model import FILE, Weights

RIDGE = 0.001  # on weights, of a mean log-likelihood; smaller ones predict left-out sources hardly better
TARGET = Path(solver.gait.__file__).parent / FILE


def learnt(looks: Sequence[Look]) -> Weights:
    """Weights of the learnt classes. Every class counts alike, and within it every source and trial.

    Args:
        looks: of trials whose activity is known; those of other classes are left out.
    """
    known = [look for look in looks if look.activity in LEARNT and len(look.features)]
    x = np.concatenate([look.features for look in known])
    y = np.concatenate([np.full(len(look.features), LEARNT.index(look.activity)) for look in known])
    importance = np.concatenate(
        [np.full(len(look.features), w) for look, w in zip(known, _shares(known), strict=True)]
    )
    importance = importance / np.repeat(
        [len(look.features) for look in known], [len(look.features) for look in known]
    )
    sizes = len(LEARNT), len(NAMES)

    def unlikely(
        parameters: Float[np.ndarray, " parameters"],
    ) -> tuple[float, Float[np.ndarray, " parameters"]]:
        weights, bias = parameters[: -sizes[0]].reshape(sizes), parameters[-sizes[0] :]
        scores = x @ weights.T + bias
        scores -= scores.max(axis=1, keepdims=True)
        log_p = scores - np.log(np.exp(scores).sum(axis=1, keepdims=True))
        error = np.exp(log_p)
        error[np.arange(len(y)), y] -= 1
        error *= importance[:, None]
        value = -(importance * log_p[np.arange(len(y)), y]).sum() + RIDGE / 2 * (weights**2).sum()
        return float(value), np.concatenate([(error.T @ x + RIDGE * weights).ravel(), error.sum(axis=0)])

    start = np.zeros(sizes[0] * (sizes[1] + 1))
    found = minimize(unlikely, start, jac=True, method="L-BFGS-B", options={"maxiter": 2000, "gtol": 1e-8})
    return Weights(found.x[: -sizes[0]].reshape(sizes), found.x[-sizes[0] :])


def _shares(looks: Sequence[Look]) -> list[float]:
    """Of the whole, what each trial counts: classes alike, in a class sources, in a source trials."""
    shares = []
    for look in looks:
        of_class = [other for other in looks if other.activity is look.activity]
        of_source = [other for other in of_class if other.source == look.source]
        sources = {other.source for other in of_class}
        classes = {other.activity for other in looks}
        shares.append(1 / len(classes) / len(sources) / len(of_source))
    return shares


def write_weights(weights: Weights, looks: Sequence[Look]) -> None:
    """Put them into the package, with what they were learnt on.

    Args:
        weights: of all examples.
        looks: the examples.
    """
    counted = {a: Counter(look.source for look in looks if look.activity is a) for a in LEARNT}
    told = {
        "made_by": "python -m benchmarks.activities --learn",
        "ridge": RIDGE,
        "examples": {activity: dict(sorted(sources.items())) for activity, sources in counted.items()},
        "classes": {
            activity: {
                "bias": round(float(bias), 4),
                "weights": {name: round(float(w), 4) for name, w in zip(NAMES, row, strict=True)},
            }
            for activity, bias, row in zip(LEARNT, weights.bias, weights.weights, strict=True)
        },
    }
    TARGET.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
