"""Play a session in a laboratory to `addb-viewer watch`: `python -m benchmarks.lab_session --trials 40`.

Recordings, half of them with a fault edited in, are written byte by byte into a watched folder, one after the
other. Counted are how soon verdicts come and, by the rules of FAULTS, whether they are right. `--kills` ends
the watcher by SIGKILL at random moments and starts it again.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import psutil

from addb_viewer.watch.verdict_log import LOG, Stage, VerdictLine, log_folder, read_log
from benchmarks.faults.editor.draw import CLEAN, Case, drawn
from benchmarks.faults.editor.recording import write_folder
from benchmarks.faults.judge import judged, with_seconds
from benchmarks.recordings import data_folder

PIECES, PIECE_S = 40, 0.05  # a file comes in so many pieces, one in so many seconds
LONGEST_S = 240.0  # that a verdict is waited for
FIRST_S, VERDICT_S = 5.0, 10.0  # the goals


@dataclass(frozen=True)
class Played:
    """One trial."""

    case: Case
    outcome: str  # as FAULTS counts; "late" where no verdict came
    lines: tuple[VerdictLine, ...]
    waited_s: dict[Stage, float]  # since its last byte
    cpu_s: float  # that the watcher and its processes took for it
    twice: int  # lines of the log that say what has been said


def started(folder: Path) -> psutil.Popen:
    words = [sys.executable, "-m", "addb_viewer", "watch", str(folder), "--port", "0"]
    return psutil.Popen(words, stdout=subprocess.DEVNULL)


def cpu_of(watcher: psutil.Popen) -> float:
    """Of the command and its processes [s]."""
    own = [watcher, *watcher.children(recursive=True)]
    return sum(sum(one.cpu_times()[:2]) for one in own if one.is_running())


def chosen(data: Path, count: int, seed: int) -> list[Case]:
    """As many untouched cases as faulty ones, of one trial each, in any order."""
    cases = [case for case in drawn(data, seed) if len(case.recording.trials) == 1]
    rng = np.random.default_rng(seed)
    both = [[case for case in cases if (case.kind == CLEAN) is clean] for clean in (True, False)]
    taken = [some[k] for some in both for k in rng.permutation(len(some))[: count // 2]]
    return [taken[k] for k in rng.permutation(len(taken))]


def write_slowly(source: Path, place: Path) -> None:
    data = source.read_bytes()
    size = len(data) // PIECES + 1
    with place.open("wb", buffering=0) as file:
        for start in range(0, len(data), size):
            file.write(data[start : start + size])
            time.sleep(PIECE_S)


def play(case: Case, number: int, folder: Path, watcher: list[psutil.Popen], kill: Iterator[float]) -> Played:
    """Write a trial of a new subject and wait for its verdict; the watcher may be killed meanwhile."""
    place = folder / f"S{number:02d}"
    with tempfile.TemporaryDirectory() as scratch:
        write_folder(Path(scratch), case.recording)
        place.mkdir()
        own = case.recording.trials[0].name
        words = (Path(scratch) / "subject.toml").read_text().partition("\n[trials.")[0]
        (place / "subject.toml").write_text(words + "\n")
        for file in Path(scratch).iterdir():
            if file.name != "subject.toml" and not file.stem.startswith(own):
                shutil.copyfile(file, place / file.name)
        for name in (f"{own}.trc", f"{own}_grf.mot"):
            write_slowly(Path(scratch) / name, place / name)
    began, cpu, at, waited = time.monotonic(), cpu_of(watcher[0]), next(kill), {}
    lines: list[VerdictLine] = []
    while Stage.VERDICT not in waited and time.monotonic() - began < LONGEST_S:
        lines = [line for line in read_log(log_folder(place / "results")) if line.trial == own]
        for line in lines:
            waited.setdefault(line.stage, time.monotonic() - began)
        if time.monotonic() - began > at:
            watcher[0].kill()
            watcher[0], at, cpu = started(folder), np.inf, 0.0
        time.sleep(PIECE_S)
    log = log_folder(place / "results")
    kept, twice = log / f"{own}.json", (log / LOG).read_text().count(f'"trial":"{own}"') - len(lines)
    truth = {"case": place.name, "kind": case.kind, **asdict(case.fault)}
    figures = with_seconds(json.loads(kept.read_text())) if kept.exists() else None
    found = judged(truth, {"diagnosis": figures, "seconds_cpu": 0.0})
    outcome = found.outcome if Stage.VERDICT in waited else "late"
    return Played(case, outcome, tuple(lines), waited, cpu_of(watcher[0]) - cpu, twice)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=40)
    parser.add_argument("--seed", type=int, default=51)
    parser.add_argument("--kills", type=int, default=0, help="so many times the watcher is killed")
    given = parser.parse_args()
    cases = chosen(data_folder(), given.trials, given.seed)
    rng = np.random.default_rng(given.seed)
    killed = set(rng.permutation(len(cases))[: given.kills].tolist())
    moments = iter([float(rng.uniform(0.5, 8.0)) if n in killed else np.inf for n in range(len(cases))])
    with tempfile.TemporaryDirectory() as folder:
        watcher = [started(Path(folder))]
        time.sleep(15)  # it loads what it needs, as before the subject comes
        try:
            done = [told(play(case, n, Path(folder), watcher, moments)) for n, case in enumerate(cases)]
        finally:
            watcher[0].kill()
    print_summary(done)


def told(one: Played) -> Played:
    last = one.lines[-1] if one.lines else None
    waited = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in one.waited_s.items())
    what = f"{one.case.kind} ({one.case.source.name}): {one.outcome}"
    print(f"{what}; {waited}; {one.cpu_s:.1f} s CPU, load {os.getloadavg()[0]:.1f}")
    print(f"    {last.colour} | {last.to_do} | {last.words}" if last else "    no line", flush=True)
    return one


def print_summary(done: list[Played]) -> None:
    for stage, goal in ((Stage.FIRST, FIRST_S), (Stage.VERDICT, VERDICT_S)):
        waited = [one.waited_s.get(stage, np.inf) for one in done]
        within = sum(seconds <= goal for seconds in waited)
        print(f"{stage}: {within} of {len(done)} within {goal:.0f} s; median {np.median(waited):.1f} s")
    cpu = [one.cpu_s for one in done]
    print(f"CPU a trial: median {np.median(cpu):.1f} s, most {max(cpu):.1f} s")
    for what, is_clean in (("faulty", False), ("untouched", True)):
        print(what, dict(Counter(one.outcome for one in done if (one.case.kind == CLEAN) is is_clean)))
    without = sum(one.outcome == "late" for one in done)
    print(f"lines said twice: {sum(one.twice for one in done)}; trials without a verdict: {without}")


if __name__ == "__main__":
    main()
