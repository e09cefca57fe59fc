"""How much a recording can tell of an effect: sizes for squats, standing and short trials.

The reference sizes hold for walks of three seconds and more. For any other recording the size is stated from
its information: the log evidence that the balance loses under "nothing is wrong" once the effect is in it,
each time with the scales of model error and slack that suit best, since nobody knows them beforehand. What
inertias, mass and soft tissue can absorb is in the balance's covariance. No hypothesis of the finder takes
part.
"""

import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from solver.capture.subject.subject import open_subject
from solver.common.progress import silent
from solver.diagnosis.diagnose import repaired_balance
from solver.diagnosis.search.balance import Balance
from solver.fitting.settings import settings_for
from solver.simulate.faults.cases import CasePlan, write_case
from solver.simulate.faults.drawing import NoPlaceError
from solver.simulate.faults.hidden import UNSIZED
from solver.simulate.faults.real import RealCase, write_real

FINDABLE_NATS = 30.0  # threshold and prices of choosing take 20, chance another 8 (one deviation)
LARGEST = 4.0  # reference sizes; beyond, nobody needs a diagnosis
LEAST_GROWTH, MOST_GROWTH = 1.1, 1.6  # at a time: information is not quite the square of the size
UNTOUCHED = "untouched"
IN_MARKERS = ("marker_slip", "marker_swap", "soft_tissue")  # seen in the markers, not in the balance


def information(recorded: Path, changed: Path) -> float:
    """Log evidence lost by what was changed in a recording [nats]; infinite where frames come or go."""
    own, other = balance_as_it_is(recorded), _balance(changed)
    if len(own.residual) != len(other.residual):
        return float("inf")
    return own.solve([]).log_evidence - other.solve([]).log_evidence


def larger(size: float, nats: float) -> float | None:
    """The size that a recording should be able to tell; None where that is too large.

    Args:
        size: one that it cannot tell.
        nats: its information at that size.
    """
    growth = float(np.sqrt(FINDABLE_NATS / max(nats, FINDABLE_NATS / MOST_GROWTH**2)))
    grown = round(max(growth, LEAST_GROWTH) * size, 2)
    return grown if grown <= LARGEST else None


def write_findable(out: Path, data: Path, case: RealCase) -> None:
    """Write a real case at a size that its recording can tell, or nothing where there is no place for it."""

    def written(size: float) -> bool:
        return write_real(out, data, replace(case, size=size))

    if sized(case.id):
        _grow(out, case.name, case.size, out / "subjects" / case.matched_synthetic, written)
    else:
        written(case.size)


def write_findable_still(out: Path, plan: CasePlan) -> None:
    """Write a synthetic case, or nothing where there is no place for it.

    Each effect in a squat or in standing is written at a size that the recording can tell of it alone.
    """
    if plan.world.activity == "walk" or plan.kind not in ("single", "pair"):
        _write(out, plan)
        return
    with TemporaryDirectory() as scratch:
        alone = [_findable(Path(scratch), plan, k) for k in range(len(plan.ids))]
    sizes = tuple(size for size in alone if size is not None)
    if len(sizes) == len(alone):
        _write(out, replace(plan, sizes=sizes))


def _write(out: Path, plan: CasePlan) -> bool:
    """Whether there is a place for it."""
    try:
        write_case(out, plan)
    except NoPlaceError:
        return False
    return True


def _findable(scratch: Path, plan: CasePlan, k: int) -> float | None:
    """The size at which a recording can tell the k-th effect by itself; None where it cannot."""
    if not sized(plan.ids[k]):
        return plan.sizes[k]
    untouched = scratch / "subjects" / UNTOUCHED
    if not untouched.exists():
        write_case(scratch, replace(plan, name=UNTOUCHED, kind="clean", ids=(), sizes=()))
    of_one = replace(plan, name=f"{plan.name}_{k}", kind="single", ids=plan.ids[k : k + 1])

    def written(size: float) -> bool:
        return _write(scratch, replace(of_one, sizes=(size,)))

    return _grow(scratch, of_one.name, plan.sizes[k], untouched, written)


def _grow(
    out: Path, name: str, size: float, untouched: Path, written: Callable[[float], bool]
) -> float | None:
    """Write a case larger and larger until it can be told; None where it cannot be written or told."""
    tried: float | None = size
    while tried is not None and written(tried):
        changed = out / "subjects" / name
        nats = information(untouched, changed)
        if nats >= FINDABLE_NATS:
            return tried
        shutil.rmtree(changed)
        (out / "truth" / f"{name}.json").unlink()
        tried = larger(tried, nats)
    return None


def sized(id: str) -> bool:
    """Whether the wrench balance tells it, and there is more and less of it."""
    return id not in UNSIZED and id not in IN_MARKERS


@lru_cache(maxsize=16)
def balance_as_it_is(folder: Path) -> Balance:
    """The wrench balance of an untouched recording, which many cases share."""
    return _balance(folder)


def _balance(folder: Path) -> Balance:
    subject, settings = open_subject(folder), settings_for(folder)
    return repaired_balance(subject, settings, trials=None, reviews={}, progress=silent)[0]
