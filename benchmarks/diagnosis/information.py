"""How much a real recording can tell of an effect: sizes for short trials.

The reference sizes hold for walks of three seconds and more. For a shorter recording the size is stated from
its information: the log evidence that the balance loses under "nothing is wrong" once the effect is in it,
each time with the level of model error that suits best, since nobody knows that level beforehand. What
inertias, mass and soft tissue can absorb is in the balance's covariance. No hypothesis of the finder takes
part.
"""

import shutil
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from solver.capture.subject import open_subject
from solver.diagnosis.balance import Balance
from solver.diagnosis.diagnose import repaired_balance
from solver.diagnosis.settings import DIAGNOSIS
from solver.progress import silent
from solver.settings import settings_for
from tests.hidden_effects.hider.hidden import UNSIZED
from tests.hidden_effects.hider.real import RealCase, write_real

FINDABLE_NATS = 30.0  # threshold and prices of choosing take 20, chance another 8 (one deviation)
LARGEST = 4.0  # reference sizes; beyond, nobody needs a diagnosis
LEAST_GROWTH, MOST_GROWTH = 1.1, 1.6  # at a time: information is not quite the square of the size
IN_MARKERS = ("marker_slip", "marker_swap", "soft_tissue")  # seen in the markers, not in the balance


def information(recorded: Path, changed: Path) -> float:
    """Log evidence lost by what was changed in a recording [nats]; infinite where frames come or go."""
    own, other = balance_as_it_is(recorded), _balance(changed)
    if len(own.residual) != len(other.residual):
        return float("inf")
    return own.solve([]).log_evidence - other.solve([]).log_evidence


def larger(case: RealCase, nats: float) -> RealCase | None:
    """The case at the size that its recording should be able to tell; None where that is too large.

    Args:
        case: at a size that it cannot tell.
        nats: its information at that size.
    """
    growth = float(np.sqrt(FINDABLE_NATS / max(nats, FINDABLE_NATS / MOST_GROWTH**2)))
    size = round(max(growth, LEAST_GROWTH) * case.size, 2)
    return replace(case, size=size) if size <= LARGEST else None


def write_findable(out: Path, data: Path, case: RealCase) -> None:
    """Write a real case at a size that its recording can tell, or nothing where there is no place for it."""
    tried: RealCase | None = case
    while tried is not None and write_real(out, data, tried):
        changed = out / "subjects" / case.name
        if not sized(case):
            return
        nats = information(out / "subjects" / case.twin, changed)
        if nats >= FINDABLE_NATS:
            return
        shutil.rmtree(changed)
        (out / "truth" / f"{case.name}.json").unlink()
        tried = larger(tried, nats)


def sized(case: RealCase) -> bool:
    """Whether the wrench balance tells it, and there is more and less of it."""
    return case.id not in UNSIZED and case.id not in IN_MARKERS


@lru_cache(maxsize=16)
def balance_as_it_is(folder: Path) -> Balance:
    """The wrench balance of an untouched recording, which many cases share."""
    return _balance(folder)


def _balance(folder: Path) -> Balance:
    subject, settings = open_subject(folder), settings_for(folder)
    return repaired_balance(subject, settings, DIAGNOSIS, trials=None, reviews={}, progress=silent)[0]
