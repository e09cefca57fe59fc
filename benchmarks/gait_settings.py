"""What a threshold of the feet's motion decides: each halved and doubled, judged by plates.

    python -m benchmarks.gait_settings --out DIR

The recordings of `benchmarks.gait_events`, markers alone, one fit each; for what is read of a belt, simulated
people on belts; for plates and for which cycles count, puppets; for feet out of sight, recordings of which
some markers are hidden. Answers and what was tracked are kept in DIR: it picks up where it was stopped, then
writes GAIT_SETTINGS.md.
"""

import argparse
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Protocol

import numpy as np

from benchmarks.gait_belts import belt_answer, belted, corners_of
from benchmarks.gait_events import Case, Told, harm, without_forces
from benchmarks.gait_hidden import hidden, told_of_hidden
from benchmarks.gait_known_cycles import cycles_answer, walks
from benchmarks.gait_over_plates import over_plates, told_of_plates
from benchmarks.gait_plates import RECORDINGS, Recording, measured, steps_of
from benchmarks.gait_thresholds import Feet
from benchmarks.rewriting import Number, answer_with
from benchmarks.varied import (
    FACTORS,
    Answer,
    Variation,
    asked,
    judged_tables,
    place,
    rules,
    variations,
)
from solver.capture.subject import open_subject
from solver.gait.foot_motion import foot_motion
from solver.gait.settings import GAIT, GaitSettings
from solver.pipeline import solve
from solver.settings import Settings

PAGE = Path(__file__).with_name("GAIT_SETTINGS.md")
ANSWERS = "gait.jsonl"
BELTS, PLATES, CYCLES, HIDDEN = "Belts", "Plates", "Cycles", "Hidden"  # answers with all as usual
OF_BELTS = ("flat_from", "flat_to", "belt_window_s")
OF_PLATES = ("least_peak_N", "gap_s")
OF_CYCLES = ("walking_m_s", "longest_cycle_s")
SAME_STANCE = Number("gait/events.py", "SAME_STANCE_S")  # of plates
OF_HIDDEN = Number("gait/gait.py", "BRIDGED_S")
NOT_OF_FEET = ("threshold_N", *OF_PLATES, *OF_CYCLES, *OF_BELTS)
SHARES = ("flat_to",)  # double of which is more than one
SAME_S = 0.002  # by which an event may move and be the same
INTRODUCTION = """# What a threshold of the feet's motion decides: each halved and doubled

Made by `python -m benchmarks.gait_settings`: events from the feet of {recordings} recordings against plates
([GAIT.md](GAIT.md)). A row has, at half and at double, the squared errors in units of the bars, one missed or
extra event as one at three times its bar (mean of the persons; {usual:.2f} % with the usual thresholds), and
the events that come and go over all that there are: one that moves by more than 2 ms goes and comes.

{belts} are asked about simulated people on belts, whose walk
over a floor is known: the size of the errors of stride lengths and average speeds (mean of the persons;
{of_belts:.2f} % as it is), and the share of these that change by more than 0.1 %. Double of `flat_to` halves
what is missing to one.

{plates} and `SAME_STANCE_S` are asked about puppets, adults and children, who walk and run over
three plates in a row: over seams, along edges, beside them ([how](gait_over_plates.py)). When they land and
leave is known; errors are told as of recordings ({of_plates:.2f} % as it is). {cycles}
are asked about puppets who walk at 0.2 to 1.4 m/s and halt on the way, and about recorded people who stand,
squat, sit down and jump: cycles that miss, or that do not count, over all that count ({of_cycles:.2f} % as it
is). Below 0.4 m/s walk those who do so at home alone (Perry et al. 1995); here their cycles count. Nobody
steps on the spot or turns.

`BRIDGED_S` is asked about recorded walks and runs of which some or all markers of a
foot were hidden for 0.03 to 0.6 s: events near there, against those of the whole recording. An event that is
not told, since nobody saw the foot, is missed ({of_hidden:.2f} % as it is).

`threshold_N` was not asked: who makes up how a foot is loaded also makes up where it crosses a threshold.

"""


@dataclass(frozen=True, eq=False)
class Walked:
    """One recording: plates that judge, and what the feet's motion is made of."""

    case: Case
    corners: tuple[np.ndarray, ...]
    root: np.ndarray
    times: np.ndarray
    bodies: tuple[str, ...]

    def feet(self, settings: GaitSettings) -> Feet:
        """Their motion as thresholds see it."""
        motion = foot_motion(list(self.corners), self.root, self.times, settings)
        return Feet(motion, self.bodies)


@cache
def walked() -> tuple[Walked, ...]:
    """All recordings whose plates are a judge."""
    with tempfile.TemporaryDirectory() as scratch:
        chosen = [recording for recording in RECORDINGS if not recording.excluded]
        return tuple(_walked(one, Path(scratch) / str(k)) for k, one in enumerate(chosen))


def _walked(recording: Recording, folder: Path) -> Walked:
    without_forces(recording, folder)
    settings = replace(Settings(), trajectory=replace(Settings().trajectory, enabled=False))
    fit = solve(open_subject(folder), settings)
    trial = next(one for one in fit.trials if one.capture.name == recording.trial)
    points, loads = measured(recording)
    case = Case(recording, points, loads, steps_of(recording, points, loads), folder, ())
    assert trial.contacts is not None
    bodies = tuple(trial.contacts.foot_bodies)
    corners, p = corners_of(fit.skeleton, bodies, trial.motion.q)
    return Walked(case, tuple(corners), p[:, 0], trial.motion.times, bodies)


Event = tuple[str | int, str, float]
"""Foot, kind and time [s]."""


def answer_of(variation: Variation) -> Answer:
    """One value's, of recordings by their feet alone."""
    name, factor, settings = variation
    feet = [one.feet(settings) for one in walked()]
    told = [list(_times(one, settings)) for one in feet]
    harms = [
        (one.case.recording.folder, harm(one.case.verdict_with(of, settings)))
        for one, of in zip(walked(), feet, strict=True)
    ]
    return of_events(name, factor, harms, told, _usual())


class Knowing(Protocol):
    """A trial whose events are known."""

    @property
    def person(self) -> str: ...

    def harm(self, told: Sequence[Told]) -> float: ...


def of_events(
    name: str,
    factor: float,
    harms: Iterable[tuple[str, float]],
    told: Sequence[Sequence[Event]],
    usually: Sequence[Sequence[Event]],
) -> Answer:
    """What is wrong with events, and how many come and go.

    Args:
        name: of what was changed.
        factor: times its value.
        harms: of each trial, whose it is and what is wrong.
        told: events of each trial.
        usually: likewise, with all as usual.
    """
    told = [[(foot, kind, time) for foot, kind, time in events] for events in told]  # JSON has lists
    by_person: dict[str, list[float]] = {}
    for person, one in harms:
        by_person.setdefault(person, []).append(one)
    changed = sum(_others(a, b) + _others(b, a) for a, b in zip(told, usually, strict=True))
    events = sum(map(len, usually))
    wrong = {person: float(np.mean(each)) / len(by_person) for person, each in by_person.items()}
    return Answer(name, factor, sum(wrong.values()), changed / events, events, wrong)


@cache
def _usual() -> tuple[list[tuple[int, str, float]], ...]:
    return tuple(list(_times(one.feet(GAIT), GAIT)) for one in walked())


def _times(feet: Feet, settings: GaitSettings) -> Iterator[tuple[int, str, float]]:
    for event in feet.events(settings):
        yield event.foot, event.kind.value, event.time_s


def _others(told: Sequence[Event], known: Sequence[Event]) -> int:
    """How many have none of their foot and kind at their time."""
    return sum(
        not any(one[:2] == other[:2] and abs(one[2] - other[2]) <= SAME_S for other in known) for one in told
    )


def of_plates(kept: Path, name: str, factor: float, told: Sequence[Sequence[Event]]) -> Answer:
    """Of puppets over plates."""
    return of_events(name, factor, _harms(over_plates(kept), told), told, usually(told_of_plates, kept))


def of_hidden(kept: Path, name: str, factor: float, told: Sequence[Sequence[Event]]) -> Answer:
    """Of feet that were hidden for a while."""
    cases = hidden(kept)
    return of_events(name, factor, _harms(cases, told), told, usually(told_of_hidden, kept))


@cache
def usually(told: Callable[[str], Sequence[Sequence[Event]]], kept: Path) -> Sequence[Sequence[Event]]:
    """Events of every trial, with all constants as they are."""
    return told(str(kept))


def _harms(cases: Sequence[Knowing], told: Sequence[Sequence[Event]]) -> Iterator[tuple[str, float]]:
    for case, events in zip(cases, told, strict=True):
        yield case.person, case.harm([Told(str(foot), kind, time) for foot, kind, time in events])


def usual_for(name: str) -> str:
    """What a setting or number is compared with."""
    setting = name.partition(".")[2]
    for usual, own in ((BELTS, OF_BELTS), (PLATES, OF_PLATES), (CYCLES, OF_CYCLES)):
        if setting in own:
            return usual
    if name == SAME_STANCE.called:
        return PLATES
    return HIDDEN if name == OF_HIDDEN.called else "GaitSettings"


def of_settings(usual: str) -> Iterator[Variation]:
    """All as usual, then half and double of what is compared with that."""
    yield usual, 1.0, GAIT
    yield from (one for one in variations(GAIT, shares=SHARES) if usual_for(one[0]) == usual)


def _of_number(number: Number) -> Iterator[Variation]:
    return ((number.called, factor, number) for factor in FACTORS)


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.gait_settings", description=__doc__)
    arguments.add_argument("--out", type=Path, required=True, help="folder in which answers are kept")
    file = arguments.parse_args().out / ANSWERS
    asked(file, variations(GAIT, left_out=NOT_OF_FEET), answer_of)
    on_belts = cache(lambda: tuple(belted(file.parent / "sim")))
    asked(file, of_settings(BELTS), lambda variation: belt_answer(on_belts(), GAIT, variation))
    _ask_puppets(file)
    answers = _ask_about_hidden(file)
    usual = {one.setting: one for one in answers if one.factor == 1.0}
    text = INTRODUCTION.format(
        recordings=sum(not recording.excluded for recording in RECORDINGS),
        usual=100 * usual["GaitSettings"].wrong,
        belts=_listed(OF_BELTS),
        of_belts=100 * usual[BELTS].wrong,
        plates=_listed(OF_PLATES),
        of_plates=100 * usual[PLATES].wrong,
        cycles=_listed(OF_CYCLES),
        of_cycles=100 * usual[CYCLES].wrong,
        of_hidden=100 * usual[HIDDEN].wrong,
    )
    rows = judged_tables(
        [one for one in answers if one.setting not in usual],
        lambda name: usual[usual_for(name)],
        lambda name: place(name, {"GaitSettings": "gait"}),
    )
    PAGE.write_text("\n".join([text + rules(), "", *rows]), encoding="utf-8")


def _ask_puppets(file: Path) -> None:
    """Of plates and cycles."""
    kept = file.parent

    def over(variation: Variation) -> Answer:
        name, factor, settings = variation
        told = [
            [(event.foot, event.kind, event.time_s) for event in case.told(settings)]
            for case in over_plates(kept)
        ]
        return of_plates(kept, name, factor, told)

    def over_otherwise(variation: Variation) -> Answer:
        name, factor, number = variation
        return of_plates(kept, name, factor, answer_with(number, factor, told_of_plates, {"kept": str(kept)}))

    asked(file, of_settings(PLATES), over)
    asked(file, _of_number(SAME_STANCE), over_otherwise)
    asked(file, of_settings(CYCLES), lambda variation: cycles_answer(walks(kept), variation))


def _ask_about_hidden(file: Path) -> list[Answer]:
    kept = file.parent

    def otherwise(variation: Variation) -> Answer:
        name, factor, number = variation
        return of_hidden(kept, name, factor, answer_with(number, factor, told_of_hidden, {"kept": str(kept)}))

    asked(file, [(HIDDEN, 1.0, None)], lambda v: of_hidden(kept, v[0], v[1], usually(told_of_hidden, kept)))
    return asked(file, _of_number(OF_HIDDEN), otherwise)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


if __name__ == "__main__":
    main()
