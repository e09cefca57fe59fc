"""What a setting decides: every numeric one halved and doubled, judged by forces that the fit has not seen.

`python -m benchmarks.settings_sweep run --out DIR` fits windows of three real recordings (over ground, on a
treadmill, running) with one setting changed at a time, or one constant of a module that a fit uses, and keeps
each answer as a line of a file: it picks up where it was stopped. What is better with another value there
is asked again, about six other windows of five recordings, and what is better there too a third time, about
a trial of each of nine other persons. `… page --out DIR --page benchmarks/SETTINGS.md` sorts what has been
answered:

- *decides nothing here*: with half and with double, angles differ by less than 0.05° (RMS), forces on
  withheld blocks are missed by as much within 1 %, and as many frames count.
- *stands*: something changes, and neither half nor double foretells withheld forces and moments better by
  more than 2 %, on the mean of the recordings; or the other windows do not bear that out.
- *may be chance*: one of them does, on both sets of windows, and not beyond chance for the other persons.
- *asks for a look*: one of them does, on both sets of windows and for the other persons.

What files never need which are as clean as these (unnamed labels, broken tables, no plates) decides nothing
here and may decide much elsewhere. The diagnosis' numbers change no fit and are not in it: see
`benchmarks.diagnosis_constants`.
"""

import argparse
import json
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from benchmarks.recordings import data_folder
from benchmarks.register import tuned_numbers
from benchmarks.rewriting import NoAnswerError, Number, answer_with, scaled
from benchmarks.varied import FALSE_SHARE, Answer, Evidence, evidence, place_of_number
from solver.capture.subject import open_subject
from solver.errors import SettingsError
from solver.fit import Fit
from solver.pipeline import solve
from solver.settings import Settings, settings_from, tables
from tests.addb_viewer.app.ten_trials import RECORDINGS, write_windows

Windows = Mapping[str, tuple[str, tuple[float, float]]]
"""By the name of a folder: the recording, and from when to when [s]."""
WINDOWS: Windows = {
    "steps": ("steps", (1.3, 2.3)),
    "belt": ("belt", (0.5, 1.4)),
    "runs": ("runs", (0.7, 1.4)),
}
OTHER_WINDOWS: Windows = {
    "steps_a": ("steps", (0.0, 1.3)),
    "belt_1": ("belt", (2.0, 2.9)),
    "belt_2": ("belt", (3.2, 4.3)),
    "runs_1": ("runs", (1.6, 2.3)),
    "walks_b": ("walks", (0.6, 2.0)),
    "gait_1": ("gait", (1.25, 2.45)),
}
FACTORS = (0.5, 2.0)
OTHER_PERSONS: Mapping[str, tuple[str, str]] = {
    "level walk": ("overground_camargo2021_AB06", "levelground_ccw_fast_01_01"),
    "walk in a laboratory": ("c3d_lab_trials/lasem_FAILT01", "Walk01"),
    "walk in an exoskeleton": ("exo_apo_gordon", "NE21"),
    "walk by video": ("opencap_subject4", "walking1"),
    "another's walk by video": ("opencap_subject6", "walking1"),
    "walk over two plates": ("anomalies/tiziana2019_lencioni", "trial"),
    "drop jump by video": ("opencap_reviewed", "DJ1"),
    "landing": ("c3d_lab_trials/opensim_core", "doubleLegLanding"),
    "sprint": ("sprint_overground_dorn2012_JA1_9ms", "run0900cms"),
}
"""By name: folder of the shared data, and trial; one a person, and none of those of the windows."""
NOT_OF_A_FIT = "diagnosis"
ROOMS_OF_A_FIT = (
    *("capture/", "contact/", "dynamics/", "kinematics/", "markers/", "skeleton/"),
    *("filters.py", "foretelling_stage.py", "plate_figures.py", "torques_stage.py"),
)
SAME_DEG, SAME_SHARE, BETTER_SHARE = 0.05, 0.01, 0.02
MADE_BY_DATACLASS = "<string>"  # the file of methods that Python made: of hashes and comparisons
NO_USE = ("__post_init__", "_asdict_inner")  # checks, and copies into results
ANSWERS, USUAL, AGAIN, PERSONS = "answers.jsonl", "usual.npz", "again", "persons"
NOTHING, STANDS, CHANCE, LOOK = "decides nothing here", "stands", "may be chance", "asks for a look"
PAGE = """# What a setting decides: each halved and doubled

Made by `python -m benchmarks.settings_sweep run | page`: windows of three real recordings are fitted with
one number changed at a time; {judged} of {planned} numeric settings of a fit, and constants of the modules
that it uses, have both answers. A row has,
at half and at double, by how much more the forces and moments of withheld blocks are missed (mean of force
and moment, and of the recordings), and the largest change of the angles (RMS). With the usual settings they
are missed by {missed}.

*Decides nothing here*: angles change by less than 0.05°, withheld forces by less than 1 %, and no frame more
or less counts, or no fit of these uses it at all; files with faults, unnamed labels or no plates may need it
all the same. *Stands*: neither half nor double foretells withheld forces better by more than 2 %; or one
does, and on six other windows of five recordings it does not, with the figures of those behind. What is
better on both was asked a third time, about a trial of each of {persons} other persons. Were the other value
no better, it might as well have been the usual one, person by person: *p* is the share of all such exchanges
that leave it as much better as it is, or more, and *q* the share by chance among it and what is as surely
better (Benjamini and Hochberg, over those asked). *Asks for a look*: *q* is at most {false:g} %. *May be
chance*: it is not.
"""


@dataclass(frozen=True)
class Changed:
    """One setting at another value."""

    table: str  # as the TOML file names it
    key: str
    value: float | tuple[float, ...]
    factor: float  # of the default

    @property
    def name(self) -> str:
        """Of the setting."""
        return f"{self.table}.{self.key}"

    @property
    def field(self) -> tuple[type, str]:
        """Its class, and its name there."""
        return type(dict(tables(Settings()))[self.table]), self.key

    @property
    def settings(self) -> Settings:
        """All others as they are.

        Raises:
            SettingsError: the value is none that this setting takes.
        """
        in_file = list(self.value) if isinstance(self.value, tuple) else self.value
        table: dict[str, object] = {self.key: in_file}
        first, *inner = self.table.split(".")
        for name in reversed(inner):
            table = {name: table}
        return settings_from({first: table}, "the sweep")


def changes() -> Iterator[Changed]:
    """Half and double of every numeric setting of a fit that is not zero; of several numbers, all at once."""
    for table, stage in tables(Settings()):
        for field in fields(stage):
            default = getattr(stage, field.name)
            if table.split(".")[0] == NOT_OF_A_FIT or isinstance(default, bool) or not default:
                continue
            if isinstance(default, float):
                yield from (Changed(table, field.name, default * factor, factor) for factor in FACTORS)
            elif isinstance(default, int):
                other = (max(1, default // 2), 2 * default)
                pairs = zip(other, FACTORS, strict=True)
                yield from (Changed(table, field.name, v, f) for v, f in pairs if v != default)
            elif isinstance(default, tuple) and scaled(default, 2.0) != default:
                yield from (Changed(table, field.name, scaled(default, factor), factor) for factor in FACTORS)


@dataclass(frozen=True)
class ChangedNumber:
    """One constant of a module at another value."""

    number: Number
    factor: float

    @property
    def name(self) -> str:
        """By file and name."""
        return self.number.called


def changed_numbers() -> Iterator[ChangedNumber]:
    """Half and double of every tuned constant of the modules that a fit uses."""
    for number in tuned_numbers(ROOMS_OF_A_FIT):
        yield from (ChangedNumber(number, factor) for factor in FACTORS)


def write_recordings(folder: Path, windows: Windows) -> None:
    """The windows, unless that has been done."""
    for name, (of, window) in windows.items():
        if not (folder / name / "subject.toml").exists():
            shutil.rmtree(folder / name, ignore_errors=True)
            recording = replace(RECORDINGS[of], windows=(window,))
            write_windows(recording, data_folder() / recording.folder, folder / name)


def turning_angles(fit: Fit) -> Float[np.ndarray, "frames angles"]:
    """All coordinates of a fit's one trial that are angles [rad]."""
    turning = [c.motion != "translation" for c in fit.skeleton.free_coordinates]
    (trial,) = fit.trials
    return trial.motion.q[:, turning]


def figures(fit: Fit, usual: Float[np.ndarray, "frames angles"] | None) -> dict[str, float]:
    """What came of a fit of one trial; angles against those with the usual settings [° RMS]."""
    (trial,) = fit.trials
    found = {"frames": 0.0, "force_N": float("nan"), "moment_Nm": float("nan"), "angles_deg": 0.0}
    if trial.dynamics is not None:
        found["frames"] = float(trial.dynamics.used.sum())
    if trial.heldout is not None and trial.heldout.frames.any():
        missed = trial.heldout.residual_root[trial.heldout.frames]
        found["force_N"], found["moment_Nm"] = (
            float(np.sqrt((part**2).sum(axis=1).mean())) for part in (missed[:, :3], missed[:, 3:])
        )
    if usual is not None:
        found["angles_deg"] = float(np.degrees(np.sqrt(((turning_angles(fit) - usual) ** 2).mean())))
    return found


def figures_of_all(folder: str, setting: tuple[str, str, Any] | None = None) -> dict[str, dict[str, float]]:
    """Of every window or person, fitted in this process with the constants as they are here.

    Args:
        folder: with the windows, if any, and the usual angles.
        setting: table, key and value of one that is another than usually.
    """
    place = Path(folder)
    settings = Settings() if setting is None else Changed(*setting, factor=1.0).settings
    with np.load(place / USUAL) as usual:
        return {name: figures(_fitted(place, name, settings), usual[name]) for name in usual}


def _fitted(folder: Path, name: str, settings: Settings) -> Fit:
    """Of a window, or of another person."""
    if name in OTHER_PERSONS:
        of, trial = OTHER_PERSONS[name]
        return solve(open_subject(data_folder() / of), settings, trials=[trial])
    return solve(open_subject(folder / name), settings)


def run(folder: Path, workers: int = 1) -> None:
    """Answer what has no answer yet; then about others what is better with another value, twice."""
    asked = [*reversed([*changes()]), *changed_numbers()]  # what every fit obeys comes first
    write_recordings(folder, WINDOWS)
    _run(folder, tuple(WINDOWS), asked, workers)
    better = {name for name, _ in sorted_settings(read(folder))[LOOK]}
    write_recordings(folder / AGAIN, OTHER_WINDOWS)
    _run(folder / AGAIN, tuple(OTHER_WINDOWS), [change for change in asked if change.name in better], workers)
    twice = set(better_twice(read(folder), read(folder / AGAIN)))
    last = [change for change in asked if (change.name, change.factor) in twice]
    (folder / PERSONS).mkdir(exist_ok=True)
    _run(folder / PERSONS, tuple(OTHER_PERSONS), last, workers)


def _run(folder: Path, names: Sequence[str], asked: Sequence[Changed | ChangedNumber], workers: int) -> None:
    answers, done = folder / ANSWERS, {(a["setting"], a["factor"]) for a in read(folder)}
    waiting = [change for change in asked if (change.name, change.factor) not in done]
    if not waiting:
        return
    with watched() as used:
        usual = {name: _fitted(folder, name, Settings()) for name in names}
    np.savez(folder / USUAL, **{name: turning_angles(fit) for name, fit in usual.items()})
    found = {name: figures(fit, None) for name, fit in usual.items()}
    with answers.open("a", encoding="utf-8") as file, ThreadPoolExecutor(workers) as pool:
        if ("usual", 1.0) not in done:
            _add(file, {"setting": "usual", "factor": 1.0, "figures": found})
        for change in [one for one in waiting if isinstance(one, Changed) and one.field not in used]:
            _add(file, {"setting": change.name, "factor": change.factor, **_unused(change, found)})
            waiting.remove(change)
        for number, answer in enumerate(pool.map(partial(_answer, folder), waiting), start=1):
            _add(file, answer)
            print(f"{number} of {len(waiting)}: {answer['setting']} × {answer['factor']:g}", flush=True)


@contextmanager
def watched() -> Iterator[set[tuple[type, str]]]:
    """Which settings are used meanwhile, by class and name; to be checked, compared or written is no use."""
    used: set[tuple[type, str]] = set()
    kinds = {type(stage) for _, stage in tables(Settings())}

    def watching(kind: type) -> Callable[[object, str], Any]:
        names = {field.name for field in fields(kind)}

        def read(stage: object, name: str) -> Any:
            if name in names:
                by = sys._getframe(1).f_code
                if by.co_filename != MADE_BY_DATACLASS and by.co_name not in NO_USE:
                    used.add((kind, name))
            return object.__getattribute__(stage, name)

        return read

    for kind in kinds:
        kind.__getattribute__ = watching(kind)  # type: ignore[method-assign]
    try:
        yield used
    finally:
        for kind in kinds:
            del kind.__getattribute__


def _unused(change: Changed, usual: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    try:
        _ = change.settings
    except SettingsError as error:
        return {"refused": str(error)}
    return {"figures": usual}


def _answer(folder: Path, change: Changed | ChangedNumber) -> dict[str, Any]:
    answer = {"setting": change.name, "factor": change.factor}
    try:
        if isinstance(change, Changed):
            asks = {"folder": str(folder), "setting": (change.table, change.key, change.value)}
            return answer | {"figures": answer_with(None, 1.0, figures_of_all, asks)}
        asks = {"folder": str(folder)}
        return answer | {"figures": answer_with(change.number, change.factor, figures_of_all, asks)}
    except NoAnswerError as error:
        return answer | {"refused": str(error)}


def _add(file, answer: Mapping[str, object]) -> None:  # type: ignore[no-untyped-def]
    file.write(json.dumps(answer) + "\n")
    file.flush()


def read(folder: Path) -> list[dict]:
    """All answers so far."""
    answers = folder / ANSWERS
    lines = answers.read_text(encoding="utf-8").splitlines() if answers.exists() else []
    return [json.loads(line) for line in lines]


def sorted_settings(
    answers: list[dict], again: list[dict] | None = None, persons: list[dict] | None = None
) -> dict[str, list[tuple[str, str]]]:
    """Names of the settings by what was found of them, each with figures in words.

    Args:
        answers: of the windows that all were asked about.
        again: of others, about which only those that were better with another value were asked.
        persons: of other persons, about whom values that were better twice were asked.

    Returns:
        Under `NOTHING`, `STANDS`, `CHANCE` and `LOOK`; a setting with one answer of two is left out.
    """
    found: dict[str, list[tuple[str, str]]] = {NOTHING: [], STANDS: [], CHANCE: [], LOOK: []}
    others, twice = _effects_of_each(again or []), better_twice(answers, again or [])
    surely = evidence_of_persons(persons or [])
    for name, (effects, refused) in sorted(_effects_of_each(answers).items()):
        kind, words = NOTHING, [effect.words for effect in effects]
        better = {effect.factor for effect in effects if effect.is_better}
        if any(not effect.is_nothing for effect in effects):
            kind = LOOK if better else STANDS
        if better and name in others:
            words += [f"elsewhere {effect.words}" for effect in others[name][0]]
            asked_thrice = [one for one in twice if one[0] == name]
            kind = LOOK if asked_thrice else STANDS
            if asked_thrice and all(one in surely for one in asked_thrice):
                kind = LOOK if any(surely[one].is_beyond_chance for one in asked_thrice) else CHANCE
                words += [f"other persons × {one[1]:g}: {surely[one].words}" for one in asked_thrice]
        found[kind].append((name, "; ".join([*words, *(f"× {f:g}: refused" for f in refused)])))
    return found


def better_twice(answers: list[dict], again: list[dict]) -> list[tuple[str, float]]:
    """Settings and factors with which withheld forces are foretold better on both sets of windows."""
    others = _effects_of_each(again)
    return [
        (name, effect.factor)
        for name, (effects, _) in _effects_of_each(answers).items()
        for effect in effects
        if effect.is_better
        and any(other.is_better and other.factor == effect.factor for other in others.get(name, ([], []))[0])
    ]


def evidence_of_persons(answers: list[dict]) -> dict[tuple[str, float], Evidence]:
    """How surely each value is better for persons; those without withheld forces are left out."""
    usual = next((a["figures"] for a in answers if a["setting"] == "usual"), {})
    judged = {name: before for name, before in usual.items() if np.isfinite(before["force_N"])}
    changed = [a for a in answers if a["setting"] != "usual" and "figures" in a]
    each = [
        Answer(a["setting"], a["factor"], 0.0, 0.0, by_person=_missed_by_more(a["figures"], judged))
        for a in changed
    ]
    same = Answer("usual", 1.0, 0.0, 0.0, by_person=dict.fromkeys(judged, 0.0))
    return evidence(each, lambda _: same)


def _effects_of_each(answers: list[dict]) -> dict[str, tuple[list["Effect"], list[float]]]:
    """By name what each value changes, and which values were refused; of settings with all their answers."""
    by_setting: dict[str, dict[float, dict]] = {}
    for answer in answers:
        by_setting.setdefault(answer["setting"], {})[answer["factor"]] = answer
    usual, planned = by_setting.pop("usual", {}).get(1.0, {}).get("figures", {}), _factors_of_each()
    return {
        name: (
            [_effect(factor, a, usual) for factor, a in sorted(by_factor.items()) if "figures" in a],
            sorted(factor for factor, a in by_factor.items() if "refused" in a),
        )
        for name, by_factor in by_setting.items()
        if set(by_factor) == planned.get(name)
    }


def _place(name: str) -> str:
    if " " in name:
        return place_of_number(name)
    table, _, key = name.rpartition(".")
    return f"`{name}` | `{type(dict(tables(Settings()))[table]).__name__}.{key}`"


def _factors_of_each() -> dict[str, set[float]]:
    found: dict[str, set[float]] = {}
    for change in (*changes(), *changed_numbers()):
        found.setdefault(change.name, set()).add(change.factor)
    return found


@dataclass(frozen=True)
class Effect:
    """Of one change, on all recordings."""

    factor: float
    missed: float  # share by which withheld forces and moments are missed by more, mean; negative: by less
    largest: float  # the same of one recording, the one that changes most
    angles_deg: float  # the largest change of a recording [° RMS]
    frames: int  # by how many more, or fewer, count, of all recordings

    @property
    def is_nothing(self) -> bool:
        """Whether it is too little to be seen."""
        return self.angles_deg < SAME_DEG and abs(self.largest) < SAME_SHARE and self.frames == 0

    @property
    def is_better(self) -> bool:
        """Whether withheld forces and moments are foretold better."""
        return self.missed < -BETTER_SHARE

    @property
    def words(self) -> str:
        """For a table."""
        frames = f", {self.frames:+d} frames" if self.frames else ""
        return f"× {self.factor:g}: {100 * self.missed:+.1f} %, {self.angles_deg:.2f}°{frames}"


def _effect(factor: float, answer: Mapping[str, dict], usual: Mapping[str, Mapping[str, float]]) -> Effect:
    of = answer["figures"]
    shares = list(_missed_by_more(of, usual).values())
    frames = sum(of[name]["frames"] - before["frames"] for name, before in usual.items())
    largest = max(shares, key=abs)
    return Effect(
        factor, float(np.mean(shares)), largest, max(f["angles_deg"] for f in of.values()), int(frames)
    )


def _missed_by_more(
    of: Mapping[str, Mapping[str, float]], usual: Mapping[str, Mapping[str, float]]
) -> dict[str, float]:
    """Share by which withheld forces and moments are missed by more, of each recording."""
    keys = ("force_N", "moment_Nm")
    return {
        name: float(np.mean([of[name][key] / before[key] - 1 for key in keys]))
        for name, before in usual.items()
    }


def page(folder: Path) -> str:
    """The tables."""
    answers = read(folder)
    usual = next(a["figures"] for a in answers if a["setting"] == "usual")
    found = sorted_settings(answers, read(folder / AGAIN), read(folder / PERSONS))
    judged = sum(map(len, found.values()))
    missed = "; ".join(f"{name} {f['force_N']:.0f} N, {f['moment_Nm']:.1f} N·m" for name, f in usual.items())
    words = {"judged": judged, "planned": len(_factors_of_each()), "missed": missed}
    lines = [PAGE.format(**words, persons=len(OTHER_PERSONS), false=100 * FALSE_SHARE)]
    for kind, rows in found.items():
        lines += [
            f"## {kind.capitalize()}: {len(rows)}",
            "",
            "| setting or file | in the code | half and double |",
        ]
        lines += ["|---|---|---|", *(f"| {_place(n)} | {w} |" for n, w in rows), ""]
    return "\n".join(lines)


def main() -> None:
    """Answer, or write the page."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.settings_sweep", description=__doc__, formatter_class=raw
    )
    parser.add_argument("what", choices=("run", "page"))
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--page", type=Path)
    parser.add_argument("--workers", type=int, default=1, help="fits at once")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if given.what == "run":
        run(given.out, given.workers)
        return
    text = page(given.out)
    if given.page:
        given.page.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
