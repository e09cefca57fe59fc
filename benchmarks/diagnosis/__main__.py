"""`python -m benchmarks.diagnosis make|run|score`: hide effects, look for them, count."""

import argparse
import json
import secrets
from collections.abc import Mapping
from pathlib import Path

from benchmarks.diagnosis.curves import SECTION as BY_SIZE
from benchmarks.diagnosis.curves import curves
from benchmarks.diagnosis.information import FINDABLE_NATS, LARGEST, write_findable, write_findable_still
from benchmarks.diagnosis.matched_synthetics import estimate_matched_synthetics
from benchmarks.diagnosis.run import CPU_LIMIT_S, run_all
from benchmarks.diagnosis.score import load, report
from benchmarks.recordings import data_folder
from benchmarks.sections import write_section
from solver.simulate.faults.cases import IDS, SIZES, Mix, plan_cases, summary, write_case
from solver.simulate.faults.hidden import UNSIZED
from solver.simulate.faults.real import plan_real

SECTION = """## A small draw in tables

Made by `make bench-diagnosis` (`python -m benchmarks.diagnosis make | run | score`), seed {seed}:
{answered} of {planned} cases answered. Each is a folder with effects put into it that the finder has not
seen, or with none: half of them clean, the rest of them one effect of the catalogue at 1, 1.5 or 2.5
reference sizes, two, or one that the catalogue lacks; handed out with the true scaled model, with masses
and centres of mass perturbed, or with the generic one. Rates come with their 95 % interval (Wilson).
*Right* is the same id on the same target and nothing else. The reference sizes hold for walks; an effect
put into a squat, into standing or into a real recording (short, most of them below two seconds) has the drawn
size, or the larger one at which the recording's wrench balance loses {nats:g} nats of log evidence under
"nothing is wrong" (`information.py`). Where that takes more than {largest:g} reference sizes, this recording
cannot tell this effect and the case is left out; so is, in a real one, a plate's gain, a support or a load
where nobody weighed the person. The injected difference is counted from what the finder estimates in the
untouched recording, named there or not (`matched_synthetics.py`); parts of a vector are held to its length.
Where it is of the other sign and leaves less than a third of it, the case is listed and left out of rates.

{tables}
"""
CURVE_SIZES = (0.5, 1.0, 1.5, 2.5)


def main() -> None:
    """Parse and do."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.diagnosis", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make", help="write cases with their truth beside them")
    making.add_argument("--seed", type=int, help="drawn anew if not given")
    making.add_argument("--cases", type=int, default=300, help="synthetic ones, half of them clean")
    making.add_argument("--real", type=int, default=0, help="effects put into real recordings")
    making.add_argument(
        "--each", type=int, help="this many cases of each id at each size, for detection curves"
    )
    making.add_argument("--ids", default="", help="comma-separated; all if not given")
    making.add_argument("--sizes", default="", help="comma-separated, in reference sizes")
    running = commands.add_parser("run", help="answer every case that has no answer yet")
    running.add_argument("--limit", type=float, default=CPU_LIMIT_S, help="CPU seconds for a case")
    running.add_argument("--workers", type=int, default=1, help="cases at a time")
    running.add_argument("--only", default="", help="part of a case's name")
    running.add_argument("--discard", action="store_true", help="delete recordings once answered")
    scoring = commands.add_parser("score", help="print the tables")
    scoring.add_argument("--page", type=Path, help="page whose section is also written")
    scoring.add_argument("--curves", type=Path, help="likewise, of what `make --each` wrote, by size")
    for command in (making, running, scoring):
        command.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    if given.command == "make":
        make(given)
    elif given.command == "run":
        run_all(
            given.out.resolve(),
            limit_s=given.limit,
            discard=given.discard,
            only=given.only,
            workers=given.workers,
        )
        estimate_matched_synthetics(given.out.resolve())
    else:
        score(given)


def score(given: argparse.Namespace) -> None:
    """Print the tables, and write the sections that are wanted."""
    cases = load(given.out)
    text = report(cases)
    (given.out / "RESULTS.md").write_text(text + "\n", encoding="utf-8")
    if given.page:
        figures = {"tables": text, "nats": FINDABLE_NATS, "largest": LARGEST}
        section = _filled(SECTION, given.out, len(cases), figures)
        write_section(given.page, "diagnosis score --page", section)
    if given.curves:
        by_size = _filled(BY_SIZE, given.out, len(cases), {"tables": curves(cases)})
        write_section(given.curves, "diagnosis score --curves", by_size)
    print(text)


def _filled(wording: str, out: Path, answered: int, figures: Mapping[str, object]) -> str:
    seed = json.loads((out / "cases.json").read_text(encoding="utf-8"))["seed"]
    planned = len(list((out / "truth").glob("*.json")))
    return wording.format(seed=seed, answered=answered, planned=planned, **figures)


def make(given: argparse.Namespace) -> None:
    """Write the cases; those that are there already stay, and so does their seed."""
    listing = given.out / "cases.json"
    seed = given.seed
    if seed is None:
        seed = json.loads(listing.read_text())["seed"] if listing.exists() else secrets.randbelow(2**31)
    by_size = given.each is not None
    ids = (
        tuple(given.ids.split(",")) if given.ids else tuple(i for i in IDS if not by_size or i not in UNSIZED)
    )
    sizes = (
        tuple(float(s) for s in given.sizes.split(",")) if given.sizes else CURVE_SIZES if by_size else SIZES
    )
    given.out.mkdir(parents=True, exist_ok=True)
    if by_size:
        plans = [
            plan
            for k, size in enumerate(sizes)
            for plan in plan_cases(seed + k, Mix(0, given.each * len(ids), 0, 0), (size,), ids, f"size{k}")
        ]
    else:
        plans = plan_cases(seed, Mix.of(given.cases), sizes, ids)
    listed = {"seed": seed, "cases": [summary(plan) for plan in plans]}
    listing.write_text(json.dumps(listed, indent=1) + "\n", encoding="utf-8")
    for plan in sorted(plans, key=lambda plan: plan.world.seed):
        if not (given.out / "truth" / f"{plan.name}.json").exists():
            (write_case if by_size else write_findable_still)(given.out, plan)
    for case in plan_real(seed, given.real, sizes):
        if not (given.out / "truth" / f"{case.name}.json").exists():
            write_findable(given.out, data_folder(), case)
    print(f"seed {seed}: {len(plans)} cases in {given.out}")


if __name__ == "__main__":
    main()
