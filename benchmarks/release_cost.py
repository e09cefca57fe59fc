"""What a release costs: time by number of trials and of workers, memory, and by a trial's length.

    python -m benchmarks.release_cost --folder DIR [--trials 25 100] [--workers 1 2] [--lengths 120 500 2000]
                                      [--diagnosed 120 500] [--page]

Every build is one measurement, kept in DIR/figures.json as soon as it is made: stopped at any time, the same
words go on. `--page` writes the section of PERFORMANCE.md from what is there, and from what `release_kills`
kept in DIR/kills.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import date
from itertools import pairwise
from pathlib import Path

import numpy as np

from addb_viewer.dataset.synthesis.corpus import CorpusOptions, synthesize
from benchmarks.long_trials import write_repeated_walk
from benchmarks.release_kills import Kills
from benchmarks.release_kills import kept as kept_kills
from benchmarks.sections import write_section
from solver.capture.atomic import write_whole

PAGE = Path(__file__).parent / "PERFORMANCE.md"
EACH = 5  # trials of a subject
CORPUS = CorpusOptions(1, seed=4, traps=False, actors=2, activities=("walk",), longest_s=1.2, takes=EACH)
TERMS = ("--licence", "CC0-1.0", "--consent", "public", "--unreviewed")
FIGURES = "figures.json"
WHOLE_FRAMES = 24e6  # of the published dataset
WORTH_OF_A_WORKER = 0.4  # of the time on the clock
KILLS = 10  # builds that are to be killed
WEEK_S = 7 * 24 * 3600.0
SHARES = {120: 0.10, 500: 0.45, 2000: 0.35, 20000: 0.10}
"""Of all frames, in trials of that length: an assumption. The paper's figure of lengths shows most of its
segments below 500 frames, and cuts at 2000; its treadmill sources recorded minutes at a time."""


@dataclass(frozen=True)
class Build:
    """One build, or one diagnosis, of fresh folders."""

    what: str  # trials, length or diagnosis
    count: int  # of trials; frames of the one trial
    workers: int
    frames: int  # at the recordings' rate
    subjects: int
    seconds: float  # on the clock
    cpu_s: float  # of the command and all its processes
    peak_MB: float  # of the largest worker
    load: float  # mean number of busy processes on the machine in the minute before its end


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure what is asked and not there yet; write the section."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--trials", type=int, nargs="*", default=[])
    parser.add_argument("--workers", type=int, nargs="*", default=[1, 2])
    parser.add_argument("--lengths", type=int, nargs="*", default=[])
    parser.add_argument("--diagnosed", type=int, nargs="*", default=[])
    parser.add_argument("--page", action="store_true")
    asked = parser.parse_args(arguments)
    asked.folder.mkdir(parents=True, exist_ok=True)
    wanted = [("length", frames, 1) for frames in asked.lengths]
    wanted += [("diagnosis", frames, 1) for frames in asked.diagnosed]
    wanted += [("trials", count, workers) for count in asked.trials for workers in asked.workers]
    for what, count, workers in wanted:
        if any((b.what, b.count, b.workers) == (what, count, workers) for b in kept(asked.folder)):
            continue
        build = measured(asked.folder, what, count, workers)
        _keep(asked.folder, build)
        print(build, flush=True)
    if asked.page:
        write_section(PAGE, "release_cost", section(kept(asked.folder), kept_kills(asked.folder / "kills")))


def kept(folder: Path) -> list[Build]:
    """What has been measured."""
    path = folder / FIGURES
    return [Build(**one) for one in json.loads(path.read_text(encoding="utf-8"))] if path.is_file() else []


def measured(folder: Path, what: str, count: int, workers: int) -> Build:
    """Build a release of `count` trials, or of one with `count` frames; or diagnose the latter."""
    root, out = folder / f"{what}_{count}", folder / f"{what}_{count}_{workers}.release"
    if not root.is_dir():
        draft = folder / f"{root.name}.draft"
        for left in (draft, draft.with_name(f"{draft.name}.truth")):
            shutil.rmtree(left, ignore_errors=True)
        if what == "trials":
            synthesize(draft, CorpusOptions(**{**asdict(CORPUS), "subjects": count // EACH}))
        else:
            write_repeated_walk(draft / "subject", count)
        draft.rename(root)
        shutil.rmtree(draft.with_name(f"{draft.name}.truth"), ignore_errors=True)
    for left in (out, out.with_name(f"{out.name}.work")):
        shutil.rmtree(left, ignore_errors=True)
    words = ["dataset", "build", str(root), "--out", str(out), "--workers", str(workers), *TERMS]
    if what == "diagnosis":
        shutil.rmtree(root / "subject" / "results", ignore_errors=True)
        words = ["diagnose", str(root / "subject")]
    began = time.monotonic()
    with (folder / "last.log").open("w") as log:
        process = subprocess.Popen([sys.executable, "-m", "addb_viewer", *words], stdout=log, stderr=log)
        _, status, used = os.wait4(process.pid, 0)
    seconds = time.monotonic() - began
    if status:
        raise SystemExit(f"{' '.join(words)} failed; see {folder / 'last.log'}")
    frames, subjects, peak = count, 1, used.ru_maxrss / 1024
    if what != "diagnosis":
        told = json.loads((out / "build_log.json").read_text(encoding="utf-8"))["subjects"]
        subjects, peak = len(told), max(one["peak_MB"] for one in told.values())
    if what == "trials":
        frames = sum(len(path.read_text().splitlines()) - 6 for path in root.rglob("walk*.trc"))
    cpu = used.ru_utime + used.ru_stime
    return Build(what, count, workers, frames, subjects, seconds, cpu, peak, os.getloadavg()[0])


def _keep(folder: Path, build: Build) -> None:
    write_whole(folder / FIGURES, json.dumps([asdict(one) for one in [*kept(folder), build]], indent=1))


SECTION = """## What a release costs

{date}, `python -m benchmarks.release_cost --folder DIR --trials … --lengths … --diagnosed … --page`. A build
is everything from folders to a release. CPU seconds are of the command and all its processes, one BLAS thread
each; memory is the most that a worker held. {cores} cores, which other programs shared: *load* is how many
processes wanted one at the end of a build, so seconds on the clock say little, and CPU seconds are too high.

**By trials and workers**: synthetic walks{mean}, {each} trials a subject, default body.

{trials}

{linear}

**By a trial's length**: one subject with one trial, 100 Hz, a simulated stride, repeated, with fresh noise.

{lengths}

**All of the published dataset**: 24 million frames. Nobody publishes how they spread over trials; assumed:
{shares}.
Every trial is a subject of its own, and costs between two measured lengths are those of the shorter one a
frame, so rather too high:
{projection}

**Builds that were killed**: {kills}

**What is not met, or not known**:
{missing}
"""


def section(builds: Sequence[Build], kills: Kills | None = None) -> str:
    """As Markdown, of what has been measured."""
    trials = sorted((b for b in builds if b.what == "trials"), key=lambda b: (b.count, b.workers))
    lengths = sorted((b for b in builds if b.what == "length"), key=lambda b: b.count)
    diagnosed = {b.count: b for b in builds if b.what == "diagnosis"}
    walks = sum(b.count for b in trials)
    mean = f" of {sum(b.frames for b in trials) / walks:.0f} frames in the mean" if walks else ""
    shares = ", ".join(f"{100 * share:.0f} % in trials of {n}" for n, share in SHARES.items())
    return SECTION.format(
        date=date.today().isoformat(),
        cores=os.cpu_count(),
        mean=mean,
        each=EACH,
        trials=_trials_table(trials),
        linear="\n".join(_linear(trials)),
        lengths=_lengths_table(lengths, diagnosed),
        shares=shares,
        projection=_projection(lengths, diagnosed),
        kills="No build was killed yet." if kills is None else _kills(kills),
        missing="\n".join(_missing(trials, lengths, diagnosed, kills)),
    )


def _trials_table(builds: Sequence[Build]) -> str:
    if not builds:
        return "Not measured yet."
    head = (
        "| trials | subjects | frames | workers | clock | CPU | memory | load |\n"
        "|---:|---:|---:|---:|---:|---:|---:|---:|\n"
    )
    return head + "\n".join(
        f"| {b.count} | {b.subjects} | {b.frames} | {b.workers} | {b.seconds:.0f} s | {b.cpu_s:.0f} s | "
        f"{b.peak_MB:.0f} MB | {b.load:.1f} |"
        for b in builds
    )


def _linear(builds: Sequence[Build]) -> list[str]:
    alone = {b.count: b for b in builds if b.workers == 1}
    ratios = [
        f"{alone[many].cpu_s / alone[few].cpu_s:.2f} times from {few} to {many} trials"
        for few, many in pairwise(sorted(alone))
    ]
    saved = [
        f"{100 * (1 - two.seconds / one.seconds):.0f} % with {two.count} trials "
        f"({100 * (two.cpu_s / one.cpu_s - 1):+.0f} % CPU)"
        for two in builds
        if two.workers == 2 and (one := alone.get(two.count))
    ]
    told = (("CPU time", ratios), ("The second worker saves on the clock", saved))
    return [f"- {what}: {', '.join(figures)}." for what, figures in told if figures]


def _lengths_table(builds: Sequence[Build], diagnosed: dict[int, Build]) -> str:
    head = (
        "| frames | build, CPU | a frame | memory | fit and diagnosis, CPU | memory |\n"
        "|---:|---:|---:|---:|---:|---:|\n"
    )
    rows = []
    for b in builds:
        other = diagnosed.get(b.count)
        more = "| |" if other is None else f"{other.cpu_s:.0f} s | {other.peak_MB:.0f} MB |"
        per_frame = 1000 * b.cpu_s / b.count
        rows.append(f"| {b.count} | {b.cpu_s:.0f} s | {per_frame:.1f} ms | {b.peak_MB:.0f} MB | {more}")
    return head + "\n".join(rows)


def _projection(builds: Sequence[Build], diagnosed: dict[int, Build]) -> str:
    alone = {b.count: b.cpu_s for b in builds}
    both = {n: alone[n] + b.cpu_s for n, b in diagnosed.items() if n in alone}
    lines = []
    for words, costs in (("built", alone), ("built and diagnosed, the fit counted twice", both)):
        if not costs:
            continue
        per_frame = {n: costs[_at(costs, n)] / _at(costs, n) for n in SHARES}
        total = WHOLE_FRAMES * sum(share * per_frame[n] for n, share in SHARES.items())
        lines.append(
            f"- {words}: {total / 3600:.0f} core hours, {total / WEEK_S:.2f} core weeks "
            f"(measured at {', '.join(map(str, sorted(costs)))} frames)."
        )
    return "\n".join(lines)


def _at(costs: dict[int, float], frames: int) -> int:
    """The longest measured length that is not longer; the shortest where all are."""
    return max((n for n in costs if n <= frames), default=min(costs))


def _kills(found: Kills) -> str:
    killed = [kill for kill in found.kills if kill.happened]
    workers = f"{found.workers} worker{'' if found.workers == 1 else 's'}"
    lines = [
        f"`python -m benchmarks.release_kills --out DIR/kills`, {found.subjects} small subjects, {workers},\n"
        f"{found.undisturbed_s:.0f} s when nothing disturbs; started again if its client was killed. "
        "*The same*: every byte but the build log's.",
    ]
    for victim in ("worker", "client"):
        own = [kill for kill in killed if kill.victim == victim]
        when = ", ".join(f"{kill.after_s:.1f}" for kill in own)
        lines.append(
            f"- {victim} killed (signal 9) in {len(own)} builds, after {when or '–'} s; "
            f"{sum(kill.same for kill in own)} ended in the same release."
        )
    if found.one_more_worker_same is not None:
        same = "the same" if found.one_more_worker_same else "another"
        lines.append(f"- {found.workers + 1} workers at a time: {same} release.")
    if found.again is not None:
        stay = "stayed as they were" if found.others_same else "changed"
        lines.append(
            f"- One subject's mass changed: {found.again} of {found.subjects} subjects done again; the files "
            f"of the others {stay}."
        )
    return "\n".join(lines)


def _missing(
    trials: Sequence[Build], lengths: Sequence[Build], diagnosed: dict[int, Build], kills: Kills | None
) -> list[str]:
    built = {(b.count, b.workers) for b in trials}
    told = [
        f"- {count} trials were not built with {workers} worker{'s' if workers > 1 else ''}."
        for count in (25, 100, 400)
        for workers in (1, 2)
        if (count, workers) not in built
    ]
    if not diagnosed:
        told.append("- No diagnosis was measured.")
    if max((b.count for b in lengths), default=0) < 20_000:
        told.append("- No trial of 20 000 frames was built.")
    alone = {b.count: b for b in trials if b.workers == 1}
    for two in (b for b in trials if b.workers == 2 and b.count in alone):
        if 1 - two.seconds / alone[two.count].seconds < WORTH_OF_A_WORKER:
            most = 1 - np.ceil(two.subjects / 2) / two.subjects
            told.append(
                f"- A second worker is to save {100 * WORTH_OF_A_WORKER:.0f} % of the time; with {two.count} "
                f"trials it did not, on cores that {two.load:.0f} processes wanted. "
                f"{two.subjects} subjects, two at a time, save {100 * most:.0f} % at most."
            )
    killed = sum(kill.happened for kill in kills.kills) if kills else 0
    if killed < KILLS:
        told.append(f"- {killed} of {KILLS} builds were killed.")
    if kills is None or kills.one_more_worker_same is None:
        told.append("- Releases of one and of two workers were not compared by this script.")
    if kills is None or kills.again is None:
        told.append("- No subject was changed to see what is done again.")
    if kills and not kills.right:
        told.append(
            "- Builds that were killed, or had other workers or a changed subject, differ as told above."
        )
    worst = max((b.peak_MB for b in (*trials, *lengths)), default=0.0)
    told.append(f"- The largest worker held {worst:.0f} MB; 1600 MB are allowed.")
    return told


if __name__ == "__main__":
    main()
