"""Play a session in a laboratory to `addb-viewer watch`: `python -m benchmarks.lab_session --trials 40`.

Recordings, half of them with a fault edited in, are written byte by byte into a watched folder, one after the
other. Counted are how soon verdicts come, whether they are right (as in FAULTS), and whether what to do names
the fault. For so many trials `--kills` ends a watcher by SIGKILL and starts it again, `--replaced` writes
other files under its name first, `--full`, as root, fills the disk; `--watchers` share the folder.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from addb_viewer.watch.verdict_log import LOG, Stage, VerdictLine, log_folder, read_log
from addb_viewer.watch.what_to_do import BY_BRANCH, OFF_PLATE
from benchmarks.faults.editor.draw import CLEAN, Case, drawn
from benchmarks.faults.editor.recording import write_folder
from benchmarks.faults.judge import NAMES, judged, with_seconds
from benchmarks.recordings import data_folder
from solver.diagnosis.causes.catalogue import ABOUT

PIECES, PIECE_S = 40, 0.05  # a file comes in so many pieces, one in so many seconds
LONGEST_S = 240.0  # that a verdict is waited for
FIRST_S, VERDICT_S = 5.0, 10.0  # the goals
DISK, FULL_S = "200m", 12.0  # the disk that is filled, and for how long


@dataclass(frozen=True)
class Played:
    """One trial."""

    case: Case = field(repr=False)
    outcome: str  # as FAULTS counts; "late" where no verdict came
    sentence: str  # right, more, wrong, missed, corrected on reading; silent or alarm where nothing was done
    lines: tuple[VerdictLine, ...]
    waited_s: dict[Stage, float]  # since its last byte
    twice: int  # lines of the log that say what has been said, and verdicts beyond one of each recording


@dataclass(frozen=True)
class Trouble:
    """What befalls the watching of a trial."""

    kill_s: float = np.inf  # after the last byte
    full: bool = False
    former: Case | None = None  # of the same person, recorded under its name before


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


def worth(case: Case, line: VerdictLine, outcome: str) -> str:
    """What the sentence says of the fault: its branch of the catalogue, at its plate, markers or time."""
    if case.kind == CLEAN or not line.about:
        quiet = "silent" if case.kind == CLEAN else "corrected" if outcome == "right" else "missed"
        return "alarm" if line.about else quiet
    sure = {ABOUT[id].branch if id in ABOUT else "plate/channels" for id in NAMES[case.kind].right}
    (low, high), hits = case.fault.times_s or (0.0, 0.0), []
    times = case.recording.trials[0].times
    for key in line.about:
        branch = max((b for b in BY_BRANCH if key.startswith(b)), key=len, default=key)
        where = key.removeprefix(branch).strip().split("+")
        is_there = "plate_" not in key or case.fault.plate is None or f"plate_{case.fault.plate}" in where
        if branch == OFF_PLATE and ":" in key:
            spans = [[times[min(int(frame), len(times) - 1)] for frame in span.split(":")] for span in where]
            is_there = any(min(end, high) - max(start, low) > 0.5 * (high - low) for start, end in spans)
        hits.append(branch in sure and is_there)
    return "right" if all(hits) else "more" if any(hits) else "wrong"


Watchers = list[subprocess.Popen[bytes]]


def started(folder: Path) -> subprocess.Popen[bytes]:
    words = [sys.executable, "-m", "addb_viewer", "watch", str(folder), "--port", "0"]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL)


def play(case: Case, number: int, folder: Path, watchers: Watchers, trouble: Trouble) -> Played:
    """Write a trial of a new subject and wait for its verdict."""
    place, own = folder / f"S{number:02d}", case.recording.trials[0].name
    log = log_folder(place / "results")
    place.mkdir()
    for each in filter(None, (trouble.former, case)):
        with tempfile.TemporaryDirectory() as scratch:
            trials = (replace(each.recording.trials[0], name=own),)
            write_folder(Path(scratch), replace(each.recording, trials=trials))
            words = (Path(scratch) / "subject.toml").read_text().partition("\n[trials.")[0]
            (Path(scratch) / "subject.toml").write_text(words + "\n")
            for file in sorted(Path(scratch).iterdir(), key=lambda file: (file.stem.startswith(own), file)):
                (write_slowly if file.stem.startswith(own) else shutil.copyfile)(file, place / file.name)
        began, at, waited = time.monotonic(), trouble.kill_s if each is case else np.inf, dict[Stage, float]()
        ballast, lines = folder / ".ballast", list[VerdictLine]()
        before = sum(line.trial == own for line in read_log(log))
        if trouble.full and each is case:
            subprocess.run(["fallocate", "-l", str(shutil.disk_usage(folder).free), ballast], check=True)
        while Stage.VERDICT not in waited and (since := time.monotonic() - began) < LONGEST_S:
            lines = [line for line in read_log(log) if line.trial == own]
            for line in lines[before:]:
                waited.setdefault(line.stage, since)
            if since > at:
                watchers[0].kill()
                watchers[0], at = started(folder), np.inf
            if since > FULL_S:
                ballast.unlink(missing_ok=True)
            time.sleep(PIECE_S)
    kept, twice = log / f"{own}.json", (log / LOG).read_text().count(f'"trial":"{own}"') - len(lines)
    twice += sum(line.stage is Stage.VERDICT for line in lines) - (2 if trouble.former else 1)
    truth = {"case": place.name, "kind": case.kind, **asdict(case.fault)}
    figures = with_seconds(json.loads(kept.read_text())) if kept.exists() else None
    found = judged(truth, {"diagnosis": figures, "seconds_cpu": 0.0})
    outcome = found.outcome if Stage.VERDICT in waited else "late"
    sentence = worth(case, lines[-1], outcome) if lines else "late"
    return Played(case, outcome, sentence, tuple(lines), waited, twice)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    usual = {"trials": 40, "seed": 51, "watchers": 1, "kills": 0, "replaced": 0, "full": 0}
    for name, value in usual.items():
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    cases = chosen(data_folder(), given.trials, given.seed)
    rng = np.random.default_rng(given.seed)
    each = [rng.permutation(len(cases)) for _ in range(3)]
    clean = [case for case in drawn(data_folder(), given.seed + 1) if case.kind == CLEAN]
    with tempfile.TemporaryDirectory() as folder:
        if given.full:
            subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK}", "tmpfs", folder], check=True)
        watchers = [started(Path(folder)) for _ in range(given.watchers)]
        time.sleep(15)  # they load what they need, as before the subject comes
        try:
            done = []
            for n, case in enumerate(cases):
                kill_s = float(rng.uniform(0.0, 5.0)) if each[0][n] < given.kills else np.inf
                others = [c for c in clean if c.source == case.source and c.fault.what != case.fault.what]
                former = others[-1] if each[1][n] < given.replaced else None
                trouble = Trouble(kill_s, each[2][n] < given.full, former)
                done.append(play(case, n, Path(folder), watchers, trouble))
                befell = f"killed after {kill_s:.1f} s, full {trouble.full}, twice {former is not None}"
                print(case.kind, case.source.name, befell, done[-1], flush=True)
        finally:
            for watcher in watchers:
                watcher.kill()
            if given.full:
                subprocess.run(["umount", "--lazy", folder], check=True)
    print_summary(done)


def print_summary(done: list[Played]) -> None:
    for stage, goal in ((Stage.FIRST, FIRST_S), (Stage.VERDICT, VERDICT_S)):
        waited = [one.waited_s.get(stage, np.inf) for one in done]
        within = sum(seconds <= goal for seconds in waited)
        print(f"{stage}: {within} of {len(done)} within {goal:.0f} s; median {np.median(waited):.1f} s")
    for what, is_clean in (("faulty", False), ("untouched", True)):
        some = [one for one in done if (one.case.kind == CLEAN) is is_clean]
        print(what, dict(Counter(one.outcome for one in some)), dict(Counter(one.sentence for one in some)))
    without = sum(one.outcome == "late" for one in done)
    print(f"lines said twice: {sum(one.twice for one in done)}; trials without a verdict: {without}")


if __name__ == "__main__":
    main()
