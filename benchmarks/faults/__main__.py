"""`python -m benchmarks.faults make|run|score`: edit faults into real recordings, ask, count."""

import argparse
import json
import secrets
from pathlib import Path

from benchmarks.diagnosing import CPU_LIMIT_S, run_all
from benchmarks.faults.editor.draw import CLEAN, KINDS, make
from benchmarks.faults.page import load, section, summary
from benchmarks.markdown import write_section
from benchmarks.recordings import data_folder, program_version


def main() -> None:
    """Parse and do."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make", help="write cases, and their truth in another place")
    making.add_argument("--seed", type=int, help="drawn anew if not given")
    making.add_argument("--times", type=int, help="so many times as many faults (1, or as begun)")
    making.add_argument("--kinds", nargs="+", choices=[CLEAN, *(k.name for k in KINDS)], help="only these")
    making.add_argument("--lower-body", action="store_true", help="no markers on trunk, arms and head")
    running = commands.add_parser("run", help="answer every case that has no answer yet")
    running.add_argument("--limit", type=float, default=CPU_LIMIT_S, help="CPU seconds for a case")
    running.add_argument("--workers", type=int, default=1, help="cases at a time")
    running.add_argument("--only", default="", help="part of a case's name")
    scoring = commands.add_parser("score", help="print the rates")
    scoring.add_argument("--page", type=Path, help="page whose section is also written")
    for command in (making, running, scoring):
        command.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    out = given.out.resolve()
    if given.command == "make":
        _make(out, given.seed, given.times, given.kinds, given.lower_body)
    elif given.command == "run":
        run_all(out, limit_s=given.limit, only=given.only, workers=given.workers)
    else:
        if given.page:
            write_section(given.page, "faults", section(out))
        print(summary(load(out)))


def _make(out: Path, seed: int | None, times: int | None, kinds: list[str] | None, lower_body: bool) -> None:
    """A draw keeps its seed, its size and its kinds, and names the code that answers it."""
    listing = out / "cases.json"
    begun = json.loads(listing.read_text()) if listing.exists() else {}
    seed = begun.get("seed", secrets.randbelow(2**31)) if seed is None else seed
    times = begun.get("times", 1) if times is None else times
    kinds = begun.get("kinds", []) if kinds is None else kinds
    out.mkdir(parents=True, exist_ok=True)
    count = make(out, data_folder(), seed, times, kinds, lower_body=lower_body)
    about = {
        "seed": seed,
        "times": times,
        "kinds": kinds,
        "lower_body": lower_body,
        "cases": count,
        "code": f"code {program_version()}",
    }
    listing.write_text(json.dumps(about, indent=1) + "\n")
    print(f"seed {seed}: {count} cases in {out}")


if __name__ == "__main__":
    main()
