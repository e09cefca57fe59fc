"""Thirty subjects, two of them broken, fitted two at a time, killed twice, gone on with: into PERFORMANCE.md.

`python -m benchmarks.many_subjects --folder DIR` makes the subjects and goes on where it was stopped; with
`--time` it then measures how much a second job saves.
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import date
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.sections import write_section
from solver.common.errors import SolverError
from solver.fitting.results.store import load_fit
from solver.simulate.demo import MARKERS, STATIC_MARKERS
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.subject_folder import write_subject
from solver.simulate.trial import Scenario, simulate_trial

PAGE = Path(__file__).parent / "PERFORMANCE.md"
SUBJECTS = 30
BROKEN = {"s07": "its description is cut off", "s19": "its markers end within a line"}
TIMED = 6  # subjects in the comparison of one job with two
STATIC, WALK = Scenario("static", "stand", duration=0.5), Scenario("walk", "walk", duration=1.0)
ALONE, ALL_OF_IT = "the command alone", "the command and its processes"
KILLS = ((8, ALONE), (9, ALL_OF_IT))  # after how many subjects, and what is killed
SETTLED_S = 3.0

SECTION = """## Many subjects at once

{date}, `python -m benchmarks.many_subjects --folder DIR --time`: {subjects} synthetic subjects of one second
of walking each, two of them broken: {broken}.
`addb-viewer fit ROOT --jobs 2 --quick` was ended with SIGKILL and started again with the same words:
{runs}

- Half written: {unreadable} fits, {drafts} files. Fitted twice: {twice}. Kept fits written anew: {rewritten}.
- The table at the end has {rows} rows: {fits} with a fit; {failed} failed, with the reason.
- {timing}
"""

TIMING_TEXT = """{subjects} subjects: {one:.0f} s on the clock with `--jobs 1`, {two:.0f} s with `--jobs 2`,
  {saved:.0f} % less ({cores} cores, one thread a process; in real time, before all other programs)."""


@dataclass(frozen=True)
class Run:
    """One time that the command ran."""

    done: list[str]
    kept: list[str]
    failed: list[str]
    killed: str  # what was; empty: it ended by itself
    seconds: float
    left: int  # processes that went on in spite of it
    fits: dict[str, int]  # when each kept fit was written [ns], after it
    unreadable: list[str]  # fits that are not whole

    def line(self, number: int) -> str:
        """In words."""
        ended = f"killed: {self.killed}; {self.left} processes went on" if self.killed else "ended by itself"
        return (
            f"{number}. {len(self.done)} fitted, {len(self.kept)} kept as they were, {len(self.failed)} "
            f"failed; {ended}; {len(self.unreadable)} of {len(self.fits)} fits cannot be read; "
            f"{self.seconds:.0f} s"
        )


def make_root(root: Path, names: Sequence[str]) -> None:
    """Subjects that are not there yet; a folder appears when it is whole."""
    for k, name in enumerate(names):
        if (root / name).is_dir():
            continue
        draft = root.parent / f"{name}.draft"
        shutil.rmtree(draft, ignore_errors=True)
        rng = np.random.default_rng(k)
        who = Person(mass_kg=60.0 + k, sex="female" if k % 2 else "male")
        body, captures = body_of(who, rng), []
        for scenario, markers in ((STATIC, STATIC_MARKERS), (WALK, MARKERS)):
            trial = simulate_trial(scenario, body, rng)
            plates = plates_under(trial.contacts, (0.0, scenario.duration)) if scenario is WALK else ()
            captures.append(measure(trial, plates, markers, MeasurementSettings(), rng))
        write_subject(draft, who, captures)
        draft.rename(root / name)


def break_two(root: Path) -> None:
    """One that cannot be opened, and one whose recording cannot be read."""
    for name, file in zip(BROKEN, ("_subject.json", "trials/walk/markers.trc"), strict=True):
        content = (root / name / file).read_bytes()
        (root / name / file).write_bytes(content[: min(len(content) // 2, 2000)])


def command(root: Path, jobs: int, *more: str) -> list[str]:
    """The command line that is tried."""
    return [sys.executable, "-m", "addb_viewer", "fit", str(root), "--jobs", str(jobs), "--quick", *more]


def run_once(root: Path, stop_after: int | None, killed: str, table: Path, log: Path) -> Run:
    """Start it, and kill it once so many subjects are fitted; None: let it end."""
    start = time.monotonic()
    process = subprocess.Popen(
        command(root, 2, "--json", str(table)),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    ends: dict[str, list[str]] = {"done": [], "kept": [], "failed": []}
    assert process.stdout is not None
    with log.open("a") as kept:
        for line in process.stdout:
            kept.write(line)
            kept.flush()
            found = re.match(r"\s*\d+/\d+  (\S+): (done|kept|failed) ", line)
            if found:
                ends[found[2]].append(found[1])
            if stop_after is not None and len(ends["done"]) >= stop_after:
                _kill(process, killed)
                break
    process.wait()
    seconds = time.monotonic() - start
    time.sleep(SETTLED_S)  # whatever went on in spite of the kill has been seen by now
    return Run(
        **ends,
        killed=killed if stop_after is not None else "",
        seconds=seconds,
        left=_running_in(process.pid),
        fits={file.parent.parent.name: file.stat().st_mtime_ns for file in root.glob("*/results/fit.json")},
        unreadable=unreadable(root),
    )


def _kill(process: subprocess.Popen[str], what: str) -> None:
    if what == ALL_OF_IT:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()


def _running_in(session: int) -> int:
    """How many processes of a session there are, by /proc."""
    found = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        found += int(fields[3]) == session and fields[0] != "Z"
    return found


def unreadable(root: Path) -> list[str]:
    """Kept fits that are not whole, and why."""
    found = []
    for head in sorted(root.glob("*/results/fit.json")):
        try:
            load_fit(head.parent, head.parents[1])
        except SolverError as error:
            found.append(f"{head.parents[1].name}: {error}")
    return found


def drafts_in(root: Path) -> list[str]:
    """What stands beside the fit in a results folder: a solve that `fit.json` does not name, or a draft."""
    found = []
    for results in root.glob("*/results"):
        named = (
            json.loads((results / "fit.json").read_text())["solve"]
            if (results / "fit.json").is_file()
            else ""
        )
        found += [
            str(file.relative_to(root)) for file in results.iterdir() if file.name not in ("fit.json", named)
        ]
    return found


def section(root: Path, runs: Sequence[Run], table: Path, timing: str) -> str:
    """As Markdown."""
    rows = json.loads(table.read_text())["subjects"]
    status = Counter(row["status"] for row in rows)
    fitted = Counter(name for run in runs for name in run.done)
    rewritten = [
        name
        for before, after in pairwise(runs)
        for name, written in before.fits.items()
        if after.fits[name] != written
    ]
    return SECTION.format(
        date=date.today(),
        subjects=SUBJECTS,
        broken=", ".join(f"{name} ({why})" for name, why in BROKEN.items()),
        runs="\n".join(run.line(k) for k, run in enumerate(runs, start=1)),
        unreadable=sum(len(run.unreadable) for run in runs),
        drafts=len(drafts_in(root)),
        twice=", ".join(name for name, times in fitted.items() if times > 1) or "none",
        rewritten=", ".join(rewritten) or "none",
        rows=len(rows),
        fits=status["done"] + status["kept"],
        failed=status["failed"],
        timing=timing,
    )


def timed(root: Path) -> str:
    """The same subjects fitted anew with one job and with two, before all other programs."""
    seconds = {jobs: _seconds(root, jobs) for jobs in (1, 2)}
    saved = 1 - seconds[2] / seconds[1]
    return TIMING_TEXT.format(
        subjects=len(list(root.iterdir())),
        one=seconds[1],
        two=seconds[2],
        saved=100 * saved,
        cores=os.cpu_count(),
    )


def _seconds(root: Path, jobs: int) -> float:
    start = time.monotonic()
    words = ["chrt", "-r", "1", *command(root, jobs, "--force")]
    subprocess.run(words, check=True, capture_output=True)
    return time.monotonic() - start


def main() -> None:
    """Go on where it was stopped; write the section at the end."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.many_subjects", description=__doc__)
    arguments.add_argument("--folder", type=Path, required=True, help="for the subjects; kept")
    arguments.add_argument("--time", action="store_true", help="measure what a second job saves (needs chrt)")
    given = arguments.parse_args()
    root, few = given.folder / "root", given.folder / "few"
    names = [f"s{k:02}" for k in range(SUBJECTS)]
    state, table = given.folder / "runs.json", given.folder / "table.json"
    if not state.is_file():
        root.mkdir(parents=True, exist_ok=True)
        make_root(root, names)
        break_two(root)
        state.write_text("[]")
    runs = [Run(**run) for run in json.loads(state.read_text())]
    plan = (*KILLS, (None, ""))
    for stop_after, killed in plan[len(runs) :]:
        runs.append(run_once(root, stop_after, killed, table, given.folder / "said.txt"))
        state.write_text(json.dumps([asdict(run) for run in runs]))
        print(runs[-1].line(len(runs)), flush=True)
    timing = given.folder / "timing.txt"
    if given.time and not timing.is_file():
        shutil.rmtree(few, ignore_errors=True)
        for name in names[:TIMED]:
            shutil.copytree(root / name, few / name, ignore=shutil.ignore_patterns("results"))
        timing.write_text(timed(few))
    told = timing.read_text() if timing.is_file() else "What a second job saves was not measured."
    write_section(PAGE, "many_subjects", section(root, runs, table, told))


if __name__ == "__main__":
    main()
