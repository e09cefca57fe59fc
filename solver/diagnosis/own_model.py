"""A model that was made for this very person says how large a right recording would show them."""

import numpy as np

from solver.fit import Fit
from solver.skeleton.skeleton import Skeleton
from solver.skeleton.subject_model import load_subject_model

LONG_M = 0.2  # shorter segments are measured by too few markers
FEWEST_SEGMENTS = 4
SAME_MASS = 0.005  # relative: a model of a person weighs what was entered for them
ALIKE = 0.0055  # standard deviation of log lengths, weighted with length, about their mean


def size_against_own_model(fit: Fit) -> float | None:
    """Logarithm of the fitted body's size over its own model's; None where the model is nobody's.

    A model is taken for the person's own if it weighs what was entered and all its long segments call for the
    same factor. Over 140 simulated persons with their own model that factor's logarithm scattered by 0.0015.
    """
    if fit.subject.model is None or fit.subject.mass_kg is None:
        return None
    model = load_subject_model(fit.subject.model)
    if abs(model.mass / fit.subject.mass_kg - 1) > SAME_MASS:
        return None
    before, after = _lengths_m(model), _lengths_m(fit.skeleton)
    long = [pair for pair, length in before.items() if length > LONG_M and pair in after]
    if len(long) < FEWEST_SEGMENTS:
        return None
    weight = np.array([before[pair] for pair in long])
    ratio = np.log([after[pair] / before[pair] for pair in long])
    mean = float(weight @ ratio / weight.sum())
    scatter = float(np.sqrt(weight @ (ratio - mean) ** 2 / weight.sum()))
    return mean if scatter < ALIKE else None


def _lengths_m(skeleton: Skeleton) -> dict[tuple[str, str], float]:
    """From a body's own joint to that of each body that it carries."""
    names = skeleton.body_names
    return {
        (names[joint.parent], names[child]): float(
            np.linalg.norm(joint.p_parent_frame - skeleton.joints[joint.parent].p_child_frame)
        )
        for child, joint in enumerate(skeleton.joints)
        if joint.parent >= 0
    }
