"""How often an effect is found and named, by its size: cases that `make --each` wrote."""

from collections.abc import Sequence

from benchmarks.diagnosis.rates import rate, smallest_found, table
from benchmarks.diagnosis.score import Scored
from solver.simulate.faults.hidden import UNSIZED

NEAR = 1e-3  # sizes that are one

PAGE = """# Found and named by size

Made by `python -m benchmarks.diagnosis make --each N`, `run` and `score --curves`, seed {seed}:
{answered} of {planned} cases answered. Each hides one effect in a walk or a squat, with the true scaled
model, with masses and centres of mass perturbed, or with the generic one. Sizes are in reference sizes,
whatever the recording can tell of them; those hold for walks, so squats are told apart. What has no size
(an exchange of plates or markers, wrong axes, a step beside the plates) is not here. *Named*: the same
id on the same target and nothing else; a class of three that holds it counts half. *Noticed*: the
recording is not called clean. Rates come with their 95 % interval (Wilson).

{tables}
"""


def curves(cases: Sequence[Scored]) -> str:
    """By size over all effects, and effect by effect; walks and squats apart."""
    sized = [s for s in cases if s.verdict.kind == "single" and s.id not in UNSIZED]
    parts = []
    for activity in ("walk", "squat"):
        own = [s for s in sized if s.about("world", "activity") == activity]
        if own:
            parts += [f"## {activity.capitalize()}s", overall(own), by_effect(own)]
    return "\n\n".join(parts)


def overall(cases: Sequence[Scored]) -> str:
    """Named and noticed over all effects, by size."""
    rows = []
    for size in _sizes(cases):
        own = _of_size(cases, size)
        rows.append([f"× {size:g}", _named(own), _noticed(own)])
    return table(["size", "named", "noticed"], rows)


def by_effect(cases: Sequence[Scored]) -> str:
    """Named and noticed of each id by size, as counts, and the smallest size named in nine of ten."""
    sizes, rows = _sizes(cases), []
    for id in sorted({s.id for s in cases}):
        own = [s for s in cases if s.id == id]
        smallest = smallest_found([s.size for s in own], [s.verdict.credit for s in own])
        cells = [_counts(_of_size(own, size)) for size in sizes]
        rows.append([id, *cells, "-" if smallest is None else f"{smallest:g}"])
    return table(["named (noticed) of", *[f"× {size:g}" for size in sizes], "90 % named from"], rows)


def _sizes(cases: Sequence[Scored]) -> list[float]:
    return sorted({round(s.size, 3) for s in cases})


def _of_size(cases: Sequence[Scored], size: float) -> list[Scored]:
    return [s for s in cases if abs(s.size - size) < NEAR]


def _counts(cases: Sequence[Scored]) -> str:
    if not cases:
        return ""
    named = sum(s.verdict.credit for s in cases)
    return f"{named:g} ({sum(map(_is_noticed, cases))}) of {len(cases)}"


def _named(cases: Sequence[Scored]) -> str:
    return rate(sum(s.verdict.credit for s in cases), len(cases))


def _noticed(cases: Sequence[Scored]) -> str:
    return rate(sum(map(_is_noticed, cases)), len(cases))


def _is_noticed(case: Scored) -> bool:
    return case.verdict.outcome not in ("missed", "failed")
