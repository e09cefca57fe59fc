"""`make bench-truth`: make the cases that have no figures yet, then the page."""

import argparse
import json
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from benchmarks.markdown import write_section
from benchmarks.recordings import data_folder, program_version
from benchmarks.truth import matched_synthetics, recorded, simulated, synthetic_subject
from benchmarks.truth.page import section
from solver.capture.atomic import write_whole
from solver.common.errors import SolverError


@dataclass(frozen=True)
class Case:
    """Recordings that are made and measured together, in one file."""

    part: str  # "synthetic", "simulated", "recorded" or "matched_synthetics"
    of: str = ""  # activity or folder
    person: int = 0

    @property
    def name(self) -> str:
        """Of its file."""
        return "_".join(str(p).replace("/", "_") for p in (self.part, self.of, self.person) if p != "")

    def runs(self) -> Iterator[dict[str, object]]:
        """Its figures, recording by recording."""
        if self.part == "synthetic":
            return synthetic_subject.runs()
        if self.part == "simulated":
            return simulated.runs(self.of, self.person)
        if self.part == "matched_synthetics":
            return matched_synthetics.runs(self.of)
        return recorded.runs(self.of)


def cases() -> list[Case]:
    """All of them; the longest first, so that two workers end together."""
    people = [
        Case("simulated", activity, person)
        for activity in reversed(simulated.SCENARIOS)
        for person in range(simulated.PERSONS)
    ]
    there = [folder for folder in recorded.ACTIVITY if (data_folder() / folder).is_dir()]
    whole = people + [Case(part, folder) for part in ("recorded", "matched_synthetics") for folder in there]
    return [*whole, Case("synthetic")] if (data_folder() / synthetic_subject.FOLDER).is_dir() else whole


def main() -> None:
    """Parse and do."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.truth", description=__doc__)
    parser.add_argument(
        "--out", type=Path, required=True, help="of the figures; what is there is not made again"
    )
    parser.add_argument("--page", type=Path, help="where the page goes; none if not given")
    parser.add_argument("--only", default="", help="part of a case's name; the page shows all that is there")
    parser.add_argument("--workers", type=int, default=1, help="cases at a time")
    parser.add_argument("--any-version", action="store_true", help="keep figures that other code made")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    version = program_version()
    chosen = [c for c in cases() if given.only in c.name]
    due = [c for c in chosen if not _is_made(given.out, c, None if given.any_version else version)]
    started = time.time()
    with ProcessPoolExecutor(given.workers) as pool:
        for name, seconds in pool.map(_made, due, [given.out] * len(due), [version] * len(due)):
            print(f"{name}: {seconds:.0f} s of CPU; {time.time() - started:.0f} s so far", flush=True)
    if given.page is not None:
        found = [
            json.loads(_file(given.out, c).read_text()) for c in cases() if _file(given.out, c).is_file()
        ]
        write_section(given.page, "truth", section(found, version))


def _file(out: Path, case: Case) -> Path:
    return out / f"{case.name}.json"


def _is_made(out: Path, case: Case, version: str | None) -> bool:
    """Whether there are figures, by that code or (None) by any."""
    path = _file(out, case)
    return path.is_file() and version in (None, json.loads(path.read_text(encoding="utf-8"))["version"])


def _made(case: Case, out: Path, version: str) -> tuple[str, float]:
    """Make a case and write its file. What cannot be solved is told in it, for the page to list."""
    began, runs, error = time.process_time(), [], None
    try:
        for run in case.runs():
            runs.append(run)
    except SolverError as why:
        error = str(why).replace(f"{data_folder()}/", "")
    except Exception:
        traceback.print_exc()
        error = "stopped by a fault of the program; the terminal has it"
    seconds = time.process_time() - began
    whole = {
        "part": case.part,
        "of": case.of,
        "person": case.person,
        "version": version,
        "cpu_seconds": seconds,
        "runs": runs,
        "error": error,
    }
    write_whole(_file(out, case), json.dumps(whole, indent=1))
    return case.name, seconds


if __name__ == "__main__":
    main()
