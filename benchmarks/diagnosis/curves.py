"""How often an effect is found and named, by its size: cases that `make --each` wrote."""

from collections.abc import Sequence

from benchmarks.diagnosis.rates import rate, table
from benchmarks.diagnosis.score import Scored
from solver.simulate.faults.hidden import UNSIZED

NEAR = 1e-3  # sizes that are one

SECTION = """Made by `python -m benchmarks.diagnosis make --each N`, `run` and `score --curves`, seed {seed}:
{answered} of {planned} cases answered, one hidden effect each; what has no size is not among them. Sizes are
reference sizes, whatever the recording can tell of them; those hold for walks. *Named*: the same id on
the same target and nothing else (a class of three that holds it counts half). *Noticed*: not called clean.

{tables}
"""


def curves(cases: Sequence[Scored]) -> str:
    """Named and noticed over all effects, by size; walks and squats apart."""
    sized = [s for s in cases if s.verdict.kind == "single" and s.id not in UNSIZED]
    rows = []
    for activity in ("walk", "squat"):
        of_it = [s for s in sized if s.about("world", "activity") == activity]
        for size in _sizes(of_it):
            own = [s for s in of_it if abs(s.size - size) < NEAR]
            rows.append([activity, f"× {size:g}", _named(own), _noticed(own)])
    return table(["", "size", "named", "noticed"], rows)


def _sizes(cases: Sequence[Scored]) -> list[float]:
    return sorted({round(s.size, 3) for s in cases})


def _named(cases: Sequence[Scored]) -> str:
    return rate(sum(s.verdict.credit for s in cases), len(cases))


def _noticed(cases: Sequence[Scored]) -> str:
    return rate(sum(map(_is_noticed, cases)), len(cases))


def _is_noticed(case: Scored) -> bool:
    return case.verdict.outcome not in ("missed", "failed")
