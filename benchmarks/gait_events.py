"""Gait events from the feet alone against the raw plates: into benchmarks/GAIT.md.

The judge reads the plates itself. The program gets copies without any force and is asked through its command
line. `python -m benchmarks.gait_events`
"""

import argparse
import csv
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import ezc3d
import numpy as np

from benchmarks.gait_plates import RECORDINGS, Points, Recording, Step, mean_of, measured, steps_of
from benchmarks.markdown import write_section
from benchmarks.recordings import data_folder

PAGE = Path(__file__).parent / "GAIT.md"

EDGE_S = 0.03  # [s] from a recording's ends: nobody sees what comes after
SEARCH_S = 0.15  # [s] farther off, an event is another one
SWING_S = 0.25  # [s] before a contact and after a foot-off, in which the same foot has no other event
WALKING_M_S = 0.4  # [m/s] slower, a person stands or shuffles
BARS_MS = {"contact": 20.0, "foot-off": 30.0}

SECTION = """## Events against plates

{date}. Made by `python -m benchmarks.gait_events`. {edge} events lie within 0.03 s of a
recording's first or last frame and are not asked for.

| recording | contacts | RMS ms | foot-offs | RMS ms | missed | extra | within the bar |
|---|---|---|---|---|---|---|---|
{judges}

{wrong}

### Plates that are no judge

| recording | contacts | RMS ms | foot-offs | RMS ms | missed | extra | within the bar |
|---|---|---|---|---|---|---|---|
{others}
"""


@dataclass(frozen=True)
class Told:
    """An event, as the program or a laboratory's file says it. Time from the first frame [s]."""

    foot: str
    kind: str
    time_s: float


@dataclass(frozen=True)
class Verdict:
    """One recording: errors by kind [s], told less measured, and what did not match."""

    errors: dict[str, list[float]]
    missed: list[str]
    extra: list[str]
    at_edge: int

    def rms_ms(self, kind: str) -> float | None:
        """Root mean square of the errors [ms]."""
        found = self.errors[kind]
        return 1000 * float(np.sqrt(np.mean(np.square(found)))) if found else None

    @property
    def passes(self) -> bool:
        """Whether both errors are within the bars, nothing is missed and nothing is extra."""
        return (
            not self.missed
            and not self.extra
            and all((self.rms_ms(k) or 0) <= bar for k, bar in BARS_MS.items())
        )


def without_forces(recording: Recording, into: Path) -> None:
    """The subject's folder with this trial's markers and nothing about forces or events."""
    source = data_folder() / recording.folder
    into.mkdir()
    marker_file = into / Path(recording.markers).name
    if recording.markers.endswith(".c3d"):
        _points_alone(source / recording.markers, marker_file)
    else:
        shutil.copyfile(source / recording.markers, marker_file)
    kept = ['foot_bodies = ["calcn_r", "calcn_l"]'] if recording.lone else []
    if not recording.lone:
        for line in (source / "subject.toml").read_text().splitlines():
            if line.startswith("[trials"):
                break
            file = re.fullmatch(r'(model|static) = "(.+)"', line)
            if file:
                name = Path(file[2]).name
                alone = _points_alone if name.endswith(".c3d") else shutil.copyfile
                alone(source / file[2], into / name)
            kept.append(f'{file[1]} = "{name}"' if file else line)
    described = [*kept, f"[trials.{recording.trial}]", f'markers = "{marker_file.name}"', ""]
    (into / "subject.toml").write_text("\n".join(described))


def _points_alone(source: Path, target: Path) -> None:
    """A C3D file with the points and their axes, and no analog channel, plate or event."""
    full, bare = ezc3d.c3d(str(source)), ezc3d.c3d()
    points = full["data"]["points"]
    bare["header"]["points"]["frame_rate"] = full["header"]["points"]["frame_rate"]
    for name in ("RATE", "UNITS", "LABELS", "X_SCREEN", "Y_SCREEN"):
        if name in full["parameters"]["POINT"]:
            value = full["parameters"]["POINT"][name]["value"]
            bare.add_parameter("POINT", name, value[: points.shape[1]] if name == "LABELS" else value)
    bare["data"]["points"] = points
    bare.write(str(target))


def told_from_feet(recording: Recording, folder: Path) -> list[Told]:
    """Events of the program's own table, from a folder without forces, which is made unless it is there."""
    if not folder.exists():
        without_forces(recording, folder)
    words = [sys.executable, "-m", "addb_viewer", "export", str(folder), "--to", "csv"]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    if ended.returncode:
        raise RuntimeError(f"{recording.name}: {ended.stderr.strip()}")
    tables = folder / "results" / "csv"
    begin_s = float(_rows(tables / f"{recording.trial}.csv")[0]["time_s"])
    return [_told(row, begin_s) for row in _rows(tables / "gait" / "events.csv")]


def _rows(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as lines:
        return list(csv.DictReader(lines))


def _told(row: dict[str, str], begin_s: float) -> Told:
    if row["source"] != "feet":
        raise RuntimeError(f"an event from {row['source']}, of a recording without forces")
    return Told(
        "right" if row["foot"].endswith("_r") else "left", row["event"], float(row["time_s"]) - begin_s
    )


def judged(recording: Recording, points: Points, steps: Sequence[Step], told: Sequence[Told]) -> Verdict:
    """Match what was told with what was measured, each once, the nearest first."""
    end_s = float(points.times[-1])
    counts = _counting(recording, points)
    truth = [
        Told(step.foot, kind, time)
        for step in steps
        for kind, time in (("contact", step.on_s), ("foot-off", step.off_s))
        if time is not None and counts(time)
    ]
    inside = [event for event in truth if EDGE_S < event.time_s < end_s - EDGE_S]
    errors, missed, taken = matched(inside, told)
    free = [event for k, event in enumerate(told) if k not in taken and counts(event.time_s)]
    at_edge = [event for event in truth if event not in inside]
    extra = [
        event
        for event in free
        if _is_known(recording, steps, event)
        and not any(_same(event, other) and abs(event.time_s - other.time_s) < SEARCH_S for other in at_edge)
    ]
    return Verdict(errors, missed, [_said(event) for event in extra], len(at_edge))


def matched(
    truth: Sequence[Told], told: Sequence[Told]
) -> tuple[dict[str, list[float]], list[str], set[int]]:
    """Errors by kind, what is missed, and which of those told were taken."""
    pairs = sorted(
        (abs(event.time_s - one.time_s), k, j)
        for k, event in enumerate(truth)
        for j, one in enumerate(told)
        if _same(event, one) and abs(event.time_s - one.time_s) < SEARCH_S
    )
    errors: dict[str, list[float]] = {kind: [] for kind in BARS_MS}
    seen, taken = set(), set()
    for _, k, j in pairs:
        if k not in seen and j not in taken:
            seen.add(k)
            taken.add(j)
            errors[truth[k].kind].append(told[j].time_s - truth[k].time_s)
    return errors, [_said(event) for k, event in enumerate(truth) if k not in seen], taken


def _same(one: Told, other: Told) -> bool:
    return (one.foot, one.kind) == (other.foot, other.kind)


def _said(event: Told) -> str:
    return f"{event.foot} {event.kind} at {event.time_s:.2f} s"


def _is_known(recording: Recording, steps: Sequence[Step], event: Told) -> bool:
    """Whether plates tell what this foot did at that time."""
    return recording.all_steps or any(
        step.foot == event.foot
        and (-np.inf if step.on_s is None else step.on_s - SWING_S) < event.time_s
        and event.time_s < (np.inf if step.off_s is None else step.off_s + SWING_S)
        for step in steps
    )


def _counting(recording: Recording, points: Points) -> Callable[[float], bool]:
    """Times at which the person walks: where nothing else is said, always."""
    if not recording.stands:
        return lambda _: True
    pelvis = mean_of(points, recording.pelvis)[:, [0, 2]]

    def walks(time: float) -> bool:
        near = np.abs(points.times - time) <= 0.5
        path = np.linalg.norm(pelvis[near][-1] - pelvis[near][0])
        return bool(path > WALKING_M_S * np.ptp(points.times[near]))

    return walks


@dataclass(frozen=True)
class Case:
    """A recording with all that is needed to judge events of it."""

    recording: Recording
    points: Points
    steps: Sequence[Step]
    told: Sequence[Told]

    @property
    def verdict(self) -> Verdict:
        """On the events of the program's table."""
        return judged(self.recording, self.points, self.steps, self.told)


def case_of(recording: Recording, folder: Path) -> Case:
    """Read the plates, and let the program see the markers."""
    points, loads = measured(recording)
    steps = steps_of(recording, points, loads)
    return Case(recording, points, steps, told_from_feet(recording, folder))


def row_of(name: str, verdict: Verdict) -> str:
    """A line of the table."""
    cells = []
    for kind in BARS_MS:
        found, rms = verdict.errors[kind], verdict.rms_ms(kind)
        mean = 1000 * np.mean(found) if found else None
        cells += [str(len(found)), "–" if rms is None or mean is None else f"{rms:.0f} ({mean:+.0f})"]
    cells += [str(len(verdict.missed)), str(len(verdict.extra)), "yes" if verdict.passes else "**no**"]
    return f"| {name} | {' | '.join(cells)} |"


def section(cases: Sequence[Case]) -> str:
    """As Markdown."""
    judges = [row_of(case.recording.name, case.verdict) for case in cases if not case.recording.excluded]
    others = [row_of(case.recording.name, case.verdict) for case in cases if case.recording.excluded]
    wrong = [
        f"- {case.recording.name}: {kind} {event}"
        for case in cases
        for kind, events in (("missed", case.verdict.missed), ("extra", case.verdict.extra))
        for event in events
    ]
    edge = sum(case.verdict.at_edge for case in cases if not case.recording.excluded)
    return SECTION.format(
        date=date.today(),
        judges="\n".join(judges),
        others="\n".join(others),
        wrong="\n".join(wrong) or "Nothing is missed and nothing is extra.",
        edge=edge,
    )


def main() -> None:
    """Judge every recording and write the page; with --only, print the rows."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.gait_events", description=__doc__)
    arguments.add_argument("--only", help="part of a recording's name", default="")
    arguments.add_argument("--folder", type=Path, help="where the copies without forces go; a temporary one")
    given = arguments.parse_args()
    cases = []
    with tempfile.TemporaryDirectory() as scratch:
        for k, recording in enumerate(RECORDINGS):
            if given.only in recording.name:
                cases.append(case_of(recording, (given.folder or Path(scratch)) / str(k)))
                print(row_of(recording.name, cases[-1].verdict), flush=True)
        if not given.only:
            write_section(PAGE, "gait_events", section(cases))


if __name__ == "__main__":
    main()
