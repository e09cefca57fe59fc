"""`python -m benchmarks.faults make|run|score`: edit faults into real recordings, ask, count."""

import argparse
import json
import secrets
import subprocess
from pathlib import Path

from benchmarks.diagnosis.run import CPU_LIMIT_S, run_all
from benchmarks.faults.editor.making import make
from benchmarks.faults.page import load, page, summary
from benchmarks.recordings import data_folder


def main() -> None:
    """Parse and do."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make", help="write cases, and their truth in another place")
    making.add_argument("--seed", type=int, help="drawn anew if not given")
    running = commands.add_parser("run", help="answer every case that has no answer yet")
    running.add_argument("--limit", type=float, default=CPU_LIMIT_S, help="CPU seconds for a case")
    running.add_argument("--workers", type=int, default=1, help="cases at a time")
    running.add_argument("--only", default="", help="part of a case's name")
    scoring = commands.add_parser("score", help="print the rates")
    scoring.add_argument("--page", type=Path, help="also written as a page of its own")
    for command in (making, running, scoring):
        command.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    out = given.out.resolve()
    if given.command == "make":
        _make(out, given.seed)
    elif given.command == "run":
        run_all(out, limit_s=given.limit, only=given.only, workers=given.workers)
    else:
        if given.page:
            given.page.write_text(page(out, data_folder()), encoding="utf-8")
        print(summary(load(out)))


def _make(out: Path, seed: int | None) -> None:
    """A draw keeps its seed, and names the code that answers it."""
    listing = out / "cases.json"
    if seed is None:
        seed = json.loads(listing.read_text())["seed"] if listing.exists() else secrets.randbelow(2**31)
    out.mkdir(parents=True, exist_ok=True)
    count = make(out, data_folder(), seed)
    listing.write_text(json.dumps({"seed": seed, "cases": count, "code": _code()}, indent=1) + "\n")
    print(f"seed {seed}: {count} cases in {out}")


def _code() -> str:
    command = ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "code without a version"
    return f"code {done.stdout.strip()}"


if __name__ == "__main__":
    main()
