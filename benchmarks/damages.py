"""Random damage to real recordings: nothing may crash, hang, be no human pose, or be wrong in silence.

    python -m benchmarks.damages [--count 10000] [--out build/damages] [--seed 1] [--jobs 2]

Two seconds of each recording are fitted as they are, then again and again with markers, plates or frames
removed, exchanged, frozen, shifted or made nonsense of, several at once. Every case is a seed; answers are
kept, so that a stopped program goes on where it was, and the table goes into benchmarks/ZOO.md.
"""

import argparse
import json
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from addb_viewer import Plate, Subject
from addb_viewer.api.recording import Recording, recording_from
from addb_viewer.api.subject_fit import Fit
from benchmarks.markdown import write_section
from benchmarks.recordings import data_folder, described_folders
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.common.errors import SolverError
from solver.fitting.settings import Settings

PAGE = Path(__file__).with_name("ZOO.md")
WINDOW_S = 2.0
MOST_AT_ONCE = 6
LONGEST_S = 300
FAR_S = 0.5  # beyond the reach of the fit's splines and filters
MASS_WITHIN = 0.10
FARTHEST_M = 1.0  # of the centre of mass from the middle of the markers and from the undamaged fit's
HUMAN_DEG = {"knee_angle": (-30.0, 170.0), "elbow_flex": (-30.0, 175.0), "pelvis_tilt": (-180.0, 180.0)}
DIAGNOSED = 10  # every so many cases the diagnosis is asked as well


@dataclass(frozen=True)
class Damage:
    """What was done to a recording, on frames start to end − 1 of its markers."""

    kind: str
    what: tuple[str, ...]  # markers or plates
    start: int
    end: int


@dataclass(frozen=True)
class Case:
    """What became of one damaged recording."""

    recording: str
    seed: int
    damages: tuple[Damage, ...]
    seconds: float
    outcome: str  # "fitted", "refused", "crashed", "hung"
    sentence: str = ""  # of a refusal or a crash
    faults: tuple[str, ...] = ()  # what nobody was told, or nobody can do
    moved_deg: float | None = None  # far from every damage, the joint that moved most, RMS


Editor = Callable[[Recording, np.random.Generator], tuple[Recording, Damage]]


def damaged(recording: Recording, seed: int) -> tuple[Recording, tuple[Damage, ...]]:
    """The recording with one to several damages drawn by this seed."""
    random = np.random.default_rng(seed)
    done = []
    for _ in range(int(random.integers(1, MOST_AT_ONCE + 1))):
        editor = EDITORS[int(random.integers(len(EDITORS)))]
        if editor in PLATE_EDITORS and not recording.plates:
            editor = EDITORS[0]
        recording, damage = editor(recording, random)
        done.append(damage)
    return recording, tuple(done)


def _range(recording: Recording, random: np.random.Generator) -> tuple[int, int]:
    frames = len(recording.times)
    length = int(np.ceil(frames * random.choice([0.02, 0.1, 0.3, 1.0], p=[0.3, 0.4, 0.2, 0.1])))
    start = int(random.integers(frames - length + 1))
    return start, start + length


def _some(recording: Recording, random: np.random.Generator) -> np.ndarray:
    """Indices of one marker, a few that lie together, a side's, or all."""
    count = len(recording.marker_names)
    how = random.integers(5)
    if how <= 1:
        return random.integers(count, size=1)
    if how == 2:  # neighbours in space, as a hand or a chair hides them
        middle = np.nan_to_num(np.nanmedian(np.asarray(recording.markers), axis=0))
        near = np.linalg.norm(middle - middle[random.integers(count)], axis=1)
        return np.argsort(near)[: int(random.integers(2, 9))]
    if how == 3:
        return random.choice(count, size=int(random.integers(2, max(3, count // 2))), replace=False)
    return np.arange(count)


def _edit_markers(kind: str, change: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Editor:
    def edit(recording: Recording, random: np.random.Generator) -> tuple[Recording, Damage]:
        start, end = _range(recording, random)
        which = _some(recording, random)
        markers = np.array(recording.markers)
        markers[start:end, which] = change(markers[start:end, which], random)
        names = tuple(recording.marker_names[k] for k in which)
        return replace(recording, markers=markers), Damage(kind, names, start, end)

    return edit


def _exchange(recording: Recording, random: np.random.Generator) -> tuple[Recording, Damage]:
    start, end = _range(recording, random)
    a, b = random.choice(len(recording.marker_names), size=2, replace=False)
    markers = np.array(recording.markers)
    markers[start:end, [a, b]] = markers[start:end, [b, a]]
    names = (recording.marker_names[a], recording.marker_names[b])
    return replace(recording, markers=markers), Damage("exchanged", names, start, end)


def _edit_plate(kind: str, change: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Editor:
    def edit(recording: Recording, random: np.random.Generator) -> tuple[Recording, Damage]:
        start, end = _range(recording, random)
        k = int(random.integers(len(recording.plates)))
        plate = recording.plates[k]
        assert plate.moment is not None
        times = np.asarray(plate.times)
        chosen = (times >= recording.times[start]) & (times <= recording.times[end - 1])
        wrench = np.hstack([plate.force, plate.moment])
        wrench[chosen] = change(wrench[chosen], random)
        plates = list(recording.plates)
        plates[k] = Plate(wrench[:, :3], plate.times, moment=wrench[:, 3:])
        return replace(recording, plates=plates), Damage(kind, (f"plate {k + 1}",), start, end)

    return edit


def _spike(wrench: np.ndarray, random: np.random.Generator) -> np.ndarray:
    wrench = wrench.copy()
    if len(wrench):
        row, column = random.integers(len(wrench)), random.integers(6)
        wrench[row, column] = random.choice([1e10, -1e10, 1e5, np.nan])
    return wrench


MARKER_EDITORS: tuple[Editor, ...] = (
    _edit_markers("removed", lambda x, _: np.full_like(x, np.nan)),
    _edit_markers("frozen", lambda x, _: np.broadcast_to(x[:1], x.shape)),
    _edit_markers("at the origin", lambda x, _: np.zeros_like(x)),
    _edit_markers("shifted", lambda x, random: x + random.normal(0.0, 0.15, 3)),
    _edit_markers("noisy", lambda x, random: x + random.normal(0.0, 0.02, x.shape)),
    _edit_markers("in one point", lambda x, _: np.broadcast_to(x[:, :1], x.shape)),
    _exchange,
)
PLATE_EDITORS: tuple[Editor, ...] = (
    _edit_plate("not recorded", lambda x, _: np.full_like(x, np.nan)),
    _edit_plate("zero", lambda x, _: np.zeros_like(x)),
    _edit_plate("held", lambda x, _: np.broadcast_to(x[:1], x.shape)),
    _edit_plate("offset", lambda x, random: x + np.r_[0.0, random.normal(0.0, 80.0), np.zeros(4)]),
    _edit_plate("scaled", lambda x, random: x * random.choice([-1.0, 0.5, 2.0])),
    _edit_plate("with a spike", _spike),
)
EDITORS = (*MARKER_EDITORS, *PLATE_EDITORS)


def windows() -> Iterator[tuple[str, Recording]]:
    """Two seconds from the middle of each described recording's trials, arrays as they were read."""
    for folder in described_folders():
        try:
            subject = open_subject(folder)
        except SolverError:
            continue
        for files in subject.trials:
            try:
                recording = recording_from(read_trial(files, Settings().reading))
            except SolverError:
                continue
            yield f"{folder.relative_to(data_folder())}/{files.name}", cut(recording)


def cut(recording: Recording, window_s: float = WINDOW_S) -> Recording:
    """Its middle, a window long [s]."""
    times = np.asarray(recording.times)
    begin = max(times[0], (times[0] + times[-1] - window_s) / 2)
    frames = (times >= begin) & (times <= begin + window_s)
    plates = []
    for plate in recording.plates:
        assert plate.moment is not None
        samples = (np.asarray(plate.times) >= begin) & (np.asarray(plate.times) <= begin + window_s)
        force, moment = np.nan_to_num(plate.force[samples]), np.nan_to_num(plate.moment[samples])
        plates.append(Plate(force, np.asarray(plate.times)[samples], moment=moment))
    return Recording(np.asarray(recording.markers)[frames], recording.marker_names, times[frames], plates)


def fitted(recording: Recording) -> Subject:
    """A subject of this recording alone, nothing checked at the door."""
    return Subject.from_recordings({"trial": recording}, check=False)


def case(name: str, recording: Recording, before: Fit, seed: int) -> Case:
    """Damage, fit, and hold the answer against the undamaged one."""
    harmed, damages = damaged(recording, seed)
    begin, outcome, sentence, faults, moved = time.perf_counter(), "fitted", "", [], None
    signal.signal(signal.SIGALRM, _too_long)
    signal.alarm(LONGEST_S)
    try:
        subject = fitted(harmed)
        fit = subject.fit()
        faults = list(faults_of(fit, before))
        moved = moved_far_from(damages, fit, before, len(recording.times))
        if seed % DIAGNOSED == 0:
            subject.diagnose()
    except SolverError as error:
        outcome, sentence = "refused", str(error)
    except TimeoutError:
        outcome = "hung"
    except Exception as error:
        outcome, sentence = "crashed", f"{type(error).__name__}: {error}"
    finally:
        signal.alarm(0)
    return Case(name, seed, damages, time.perf_counter() - begin, outcome, sentence, tuple(faults), moved)


def faults_of(fit: Fit, before: Fit) -> Iterator[str]:
    """What nobody can do, and a mass that is off without a word."""
    trial = fit[0]
    for name in trial.coordinates.names:
        for start, (low, high) in HUMAN_DEG.items():
            if name.startswith(start) and not name.endswith("beta"):
                degrees = np.degrees(trial.coordinates[name])
                most, least = np.nanmax(degrees, initial=-np.inf), np.nanmin(degrees, initial=np.inf)
                if most > high or least < low:
                    yield f"{name} {least:.0f} to {most:.0f}°"
    known = np.isfinite(trial.markers.values).all(axis=2)
    seen = np.where(known[..., None], trial.markers.values, 0.0).sum(axis=1)
    with np.errstate(invalid="ignore"):
        places = (before[0].com.values, seen / known.sum(axis=1, keepdims=True))
    far = np.min([np.linalg.norm(trial.com.values - place, axis=1) for place in places], axis=0)
    posed = np.isfinite(trial.coordinates.values).any(axis=1)
    if (posed & ~known.any(axis=1)).sum() > FAR_S * trial.rate:
        yield f"{(posed & ~known.any(axis=1)).sum()} frames with a pose of nobody"
    if np.nanmax(far, initial=0.0) > FARTHEST_M:
        yield f"centre of mass {np.nanmax(far):.1f} m off"
    off = fit.mass_kg / before.mass_kg - 1.0
    if abs(off) > MASS_WITHIN and not set(_about_mass(fit)) - set(_about_mass(before)):
        yield f"mass {off:+.0%}, nothing said"


def _about_mass(fit: Fit) -> Iterator[str]:
    words = ("mass", "weigh", "force", "plate")
    for note in (*fit.notes, *fit[0].notes):
        if any(word in str(note).lower() for word in words):
            yield str(note)


def moved_far_from(damages: Sequence[Damage], fit: Fit, before: Fit, frames: int) -> float | None:
    """RMS of how far the joint that moved most is from the undamaged fit [°]; None: no frame is far."""
    far = np.ones(frames, dtype=bool)
    reach = int(FAR_S * fit[0].rate)
    for damage in damages:
        far[max(0, damage.start - reach) : damage.end + reach] = False
    legs = [n for n in fit[0].coordinates.names if n.startswith(("hip_flex", "knee_angle", "ankle_angle"))]
    legs = [n for n in legs if n in before[0].coordinates.names and not n.endswith("beta")]
    if far.sum() < 10 or not legs:
        return None
    moved = [np.degrees(fit[0].coordinates[n] - before[0].coordinates[n])[far] for n in legs]
    rms = [float(np.sqrt(np.nanmean(m**2))) for m in moved if np.isfinite(m).any()]
    return max(rms, default=None)


def _too_long(*_: object) -> None:
    raise TimeoutError


def table(cases: Sequence[Case]) -> str:
    """What became of the cases, the answer first."""
    bad = [c for c in cases if c.outcome in ("crashed", "hung") or c.faults]
    harmed = sum(len(c.damages) for c in cases)
    moved = np.array([c.moved_deg for c in cases if c.moved_deg is not None])
    count = {o: sum(c.outcome == o for c in cases) for o in ("fitted", "refused", "crashed", "hung")}
    whole = len({c.recording for c in cases})
    silent = sum(bool(c.faults) for c in cases)
    lines = [
        f"Of {len(cases)} cases with {harmed} random damages in {whole} recordings, {count['fitted']} were",
        f"fitted, {count['refused']} refused with a sentence, {count['crashed']} crashed and {count['hung']}",
        f"hung; {silent} have a pose that nobody takes, or a mass off by over {MASS_WITHIN:.0%} in silence.",
    ]
    if len(moved):
        p50, p95 = np.percentile(moved, [50, 95])
        lines.append(
            f"\nMore than {FAR_S} s from every damage, the leg joint that moved most moved by {p50:.2f}° "
            f"(median; 95 %: {p95:.2f}°)."
        )
    if bad:
        lines.append("\n| recording | seed | damages | what is wrong |\n|---|---|---|---|")
        for c in bad[:40]:
            done = ", ".join(f"{d.kind} {len(d.what)}" for d in c.damages)
            wrong = "; ".join(
                [*c.faults, *([c.outcome, c.sentence] if c.outcome in ("crashed", "hung") else [])]
            )
            lines.append(f"| {c.recording} | {c.seed} | {done} | {wrong[:200]} |")
    return "\n".join(lines)


def _cases_of(name: str, recording: Recording, seeds: Sequence[int], kept: Path) -> None:
    before = fitted(recording).fit()
    for seed in seeds:
        with kept.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(case(name, recording, before, seed))) + "\n")


def read_cases(kept: Path) -> Iterator[Case]:
    """Cases that are kept in a folder."""
    for file in sorted(kept.glob("*.jsonl")):
        for line in file.read_text(encoding="utf-8").splitlines():
            told = json.loads(line)
            damages = tuple(
                Damage(d["kind"], tuple(d["what"]), d["start"], d["end"]) for d in told["damages"]
            )
            yield Case(**told | {"damages": damages, "faults": tuple(told["faults"])})


def main() -> None:
    """Make what is missing, and put the table into the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.damages", description=__doc__)
    parser.add_argument("--count", type=int, default=10_000, help="cases in all")
    parser.add_argument("--seed", type=int, default=1, help="the first case's")
    parser.add_argument("--out", type=Path, default=Path("build/damages"), help="where answers are kept")
    parser.add_argument("--jobs", type=int, default=1, help="recordings at once")
    parser.add_argument("--only", default="", help="part of a recording's name; the page is not written")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    wanted = [(n, r) for n, r in windows() if chosen.only in n]
    done = {(c.recording, c.seed) for c in read_cases(chosen.out)}
    with ProcessPoolExecutor(chosen.jobs) as pool:
        jobs = {}
        for k, (name, recording) in enumerate(wanted):
            seeds = range(chosen.seed + k, chosen.seed + chosen.count, len(wanted))
            due = [seed for seed in seeds if (name, seed) not in done]
            kept = chosen.out / f"{name.replace('/', '__')}.jsonl"
            jobs[name] = pool.submit(_cases_of, name, recording, due, kept)
        for name, job in jobs.items():
            job.result()
            print(name, flush=True)
    text = table([c for c in read_cases(chosen.out) if chosen.only in c.recording])
    print(text)
    if not chosen.only:
        write_section(PAGE, "damages", f"## Random damage\n\n{text}")


if __name__ == "__main__":
    main()
