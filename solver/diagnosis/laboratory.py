"""What every laboratory is off by: plates tared and placed as well as it is done with care.

A newton of shear that stays all through a quiet squat would else be evidence as strong as a fault's, and
stand in the way of what is really wrong. The columns are those of the causes themselves, one for each plate,
shared by all trials; how far they go stands beside the causes (`usual_std`), well below what anybody would
act on.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.diagnosis.rows import TrialRows
from solver.diagnosis_settings import DiagnosisSettings
from solver.effects.catalogue import MODULES
from solver.effects.effect import Candidate, Corrected


def usual_std(candidate: Candidate, settings: DiagnosisSettings) -> float:
    """Size of a cause's parameters that is there in every laboratory; zero for causes that need not be."""
    return dict(settings.laboratory).get(candidate.id, candidate.about.usual_std)


def laboratory_errors(
    trials: Sequence[TrialRows], settings: DiagnosisSettings
) -> Float[np.ndarray, "rows columns"]:
    """Columns of all trials together, each at one standard deviation."""
    scenes = [t.scene for t in trials]
    rows = sum(len(t.residual) for t in trials)
    found = [np.zeros((rows, 0))]
    for module in MODULES:
        std = dict(settings.laboratory).get(module.ABOUT.id, module.ABOUT.usual_std)
        for candidate in module.candidates(scenes) if std else ():
            if isinstance(candidate, Corrected) or candidate.place_odds:
                continue  # undone already, or rarer than what every laboratory has
            parts = [t.rows_of(candidate, ()) for t in trials]
            width = next(p.columns.shape[1] for p in parts if p is not None)
            of_trials = [
                np.zeros((len(t.residual), width)) if p is None else p.columns
                for t, p in zip(trials, parts, strict=True)
            ]
            found.append(std * np.concatenate(of_trials))
    return np.concatenate(found, axis=1)
