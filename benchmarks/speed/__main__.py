"""`python -m benchmarks.speed commands|app|searches --folder DIR`: into PERFORMANCE.md.

Figures are kept in DIR as soon as they are made: who is stopped goes on with the same words.
"""

import argparse
from pathlib import Path

from benchmarks.markdown import write_section
from benchmarks.speed import app_keys, command_costs, hour, searches

PAGE = Path(__file__).parents[1] / "PERFORMANCE.md"


def main() -> None:
    """Parse and do."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed", description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True)
    costs = parts.add_parser("commands", help="fits, diagnoses and releases by length, trials and workers")
    costs.add_argument("--frames", type=int, nargs="*", default=command_costs.LENGTHS)
    costs.add_argument("--trials", type=int, nargs="*", default=command_costs.TRIALS)
    working = parts.add_parser("app", help="the queue, and four people's work")
    working.add_argument("--minutes", type=float, default=60.0)
    working.add_argument("--times-over", type=int, default=30, help="each of five subjects")
    searching = parts.add_parser("searches", help="the search of diagnoses for causes")
    searching.add_argument("--only", default="", help="part of a recording's name")
    for part in (costs, working, searching):
        part.add_argument("--folder", type=Path, required=True)
        part.add_argument("--page", type=Path, default=PAGE)
    given = parser.parse_args()
    folder = given.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    if given.part == "commands":
        text = command_costs.section(folder, given.frames, given.trials)
    elif given.part == "app":
        hours = hour.hour_section(folder, given.minutes, given.times_over)
        text = f"## The app for a day's work\n\n{app_keys.queue_section()}\n\n{hours}"
    else:
        text = f"## What a diagnosis costs beyond its fit\n\n{searches.section(given.only)}"
    write_section(given.page, f"speed {given.part}", text)


if __name__ == "__main__":
    main()
