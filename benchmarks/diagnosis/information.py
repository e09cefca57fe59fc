"""How much a real recording can tell of an effect: sizes for short trials.

The reference sizes hold for walks of three seconds and more. For a shorter recording the size is stated from
its information: with Δr the change that the effect makes in the wrench balance, and K the covariance of the
balance with the model's error at the recording's own level, ½ Δrᵀ K⁻¹ Δr is the log evidence to be expected.
What inertias, mass and soft tissue can absorb is inside K. No hypothesis of the finder takes part.
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
IN_MARKERS = ("marker_slip", "marker_swap", "soft_tissue")  # seen in the markers, not in the balance


def information(recorded: Path, changed: Path) -> float:
    """Expected log evidence of what was changed in a recording [nats]; infinite where frames come or go."""
    own, other = _balance_as_it_is(recorded), _balance(changed)
    if len(own.residual) != len(other.residual):
        return float("inf")
    whitened = own.solve([]).rung.whitened(other.residual - own.residual)
    return 0.5 * float(whitened @ whitened)


def at_findable_size(case: RealCase, nats: float) -> RealCase | None:
    """The case at the size that its recording can tell: as drawn, or larger; None where that is too large.

    Args:
        case: as drawn.
        nats: its information at that size.
    """
    if not sized(case) or nats >= FINDABLE_NATS:
        return case
    size = case.size * float(np.sqrt(FINDABLE_NATS / max(nats, 1e-9)))
    return replace(case, size=round(size, 2)) if size <= LARGEST else None


def write_findable(out: Path, data: Path, case: RealCase) -> None:
    """Write a real case at a size that its recording can tell, or nothing where there is no place for it."""
    if not write_real(out, data, case):
        return
    changed = out / "subjects" / case.name
    nats = information(out / "subjects" / case.twin, changed) if sized(case) else FINDABLE_NATS
    findable = at_findable_size(case, nats)
    if findable is None or findable != case:
        shutil.rmtree(changed)
        (out / "truth" / f"{case.name}.json").unlink()
    if findable is not None:
        write_real(out, data, findable)


def sized(case: RealCase) -> bool:
    """Whether the wrench balance tells it, and there is more and less of it."""
    return case.id not in UNSIZED and case.id not in IN_MARKERS


@lru_cache(maxsize=16)
def _balance_as_it_is(folder: Path) -> Balance:
    return _balance(folder)


def _balance(folder: Path) -> Balance:
    subject, settings = open_subject(folder), settings_for(folder)
    return repaired_balance(subject, settings, DIAGNOSIS, trials=None, reviews={}, progress=silent)[0]
