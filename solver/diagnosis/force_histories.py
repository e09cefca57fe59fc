"""How a force that acts on one segment for a while grows and fades, as its cause was fitted."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.effect import Candidate, Eta, in_view
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.diagnosis_report import TIME_HISTORY_DIGITS, ForceOverTime

STEP_S = 0.02  # no contact's time history has more detail


def force_histories(
    candidate: Candidate, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
) -> tuple[ForceOverTime, ...]:
    """One for each stretch on which a cause acts; none where it acts all along or on no single segment.

    Args:
        candidate: the cause.
        scenes: of all trials.
        eta: as fitted.
        x: likewise.
    """
    found = []
    for stretch in in_view(candidate.frames(scenes, eta, x), scenes):
        scene = next(s for s in scenes if s.name == stretch.trial)
        whole = stretch.end - stretch.start >= scene.frames
        if whole or candidate.target not in scene.skeleton.body_names:
            continue
        signature = candidate.signature(scene, eta)
        if signature is None:
            continue
        step = max(1, round(STEP_S * scene.rate))
        own = slice(stretch.start, stretch.end, step)
        force = signature.columns[own, :3] @ x
        if signature.fixed is not None:
            force = force + signature.fixed[own, :3]
        told = map(tuple, force.round(TIME_HISTORY_DIGITS).tolist())
        found.append(ForceOverTime(scene.name, stretch.start, step, tuple(told)))
    return tuple(found)
