"""What a number of made-up motions decides: each halved and doubled, judged by recorded people.

    python -m benchmarks.made_up_settings --keep DIR

Some made-up people move with one number of `solver.simulate` at another value, and the figures of
`benchmarks.made_up_motions` say how far they then are from each recorded person. Fits and answers are kept in
DIR: it picks up where it was stopped, then writes MADE_UP_SETTINGS.md.
"""

import argparse
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.activities.recorded import recorded
from benchmarks.activities.simulated import EVERYTHING, simulated
from benchmarks.made_up_motions import by_activity, middles
from benchmarks.register import tuned_numbers
from benchmarks.rewriting import NoAnswerError, Number, answer_with
from benchmarks.varied import FACTORS, Answer, asked, judged_tables, place_of_number, rules

PAGE = Path(__file__).with_name("MADE_UP_SETTINGS.md")
SEEDS = (0, 100, 101)  # of persons; the first one sprints and lands as well
NOT_ASKED = ("BELT_GAP_M", "SPEED")  # a belt's build; what scenarios say instead
DONE_WITH = {
    "simulate/landing.py": ("landing",),
    "simulate/posture.py SQUAT": ("squat",),
    "simulate/posture.py STANDING": ("stand", "squat", "landing"),
    "simulate/posture.py STATIC": ("stand",),
    "RUNNING": ("run",),
    "SPRINTING": ("sprint",),
    "WALKING": ("walk",),
    "IMPACT": ("sprint",),
    "QUICK": ("sprint", "landing"),
}  # by what a number's name has in it; any other is asked about everything
UNITS = {"[°]": 10.0}  # of a figure, in which distances are told; of others:
SHARE = 0.1
UNTOLD = 10.0  # units: nobody could walk so
SAME = 0.01  # of a unit: by less a figure does not change
Figures = Mapping[tuple[str, str], float]
"""Medians of the made-up persons, by activity and figure."""
Real = tuple[str, str, Mapping[str, float]]
"""Activity, figure, and the value of each recorded person."""
INTRODUCTION = """# What a number of made-up motions decides: each halved and doubled

Made by `python -m benchmarks.made_up_settings`: made-up people beside recorded ones, by the figures of
[MADE_UP_MOTIONS.md](MADE_UP_MOTIONS.md) but for speeds, which people chose, and by how people hold
themselves in static trials. A row has, at half and at double, how far the made-up people are from a
recorded one, in tenths of a figure, or in 10° of an angle (mean of the figures, then of the persons), and
with the number as it is; and the share of figures that change. A figure that cannot be told, of a motion that
is no walk, say, counts as ten. Each number was asked about the activities that it has a part in.
"""


def figures_of(activities: Sequence[str]) -> list[tuple[str, str, float]]:
    """Activity, figure and median of the made-up persons, moved in this process."""
    with tempfile.TemporaryDirectory() as folder:
        values = by_activity(simulated(SEEDS, Path(folder), activities))
    return [(what, name, float(np.median(list(of.values())))) for what, name, of in middles(values)]


def activities_of(name: str) -> tuple[str, ...]:
    """Those that a number is asked about, by its file and name."""
    return next((of for part, of in DONE_WITH.items() if part in name), tuple(sorted(EVERYTHING)))


def distance(figure: str, made_up: float | None, of_person: float) -> float:
    """In units; of a figure that nobody can tell, `UNTOLD`."""
    if made_up is None:
        return UNTOLD
    unit = next((unit for ends, unit in UNITS.items() if figure.endswith(ends)), SHARE * abs(of_person))
    return abs(made_up - of_person) / unit


def judged(name: str, factor: float, now: Figures, usual: Figures, real: Iterable[Real]) -> Answer:
    """How far made-up people are from recorded ones.

    Args:
        name: of the number.
        factor: times its value.
        now: with that value.
        usual: with the number as it is.
        real: activity, figure, and the value of each recorded person.
    """
    away: dict[str, list[float]] = {}
    for what, figure, of_persons in real:
        if (what, figure) in usual and not figure.startswith("speed"):
            for person, value in of_persons.items():
                away.setdefault(person, []).append(distance(figure, now.get((what, figure)), value))
    by_person = {person: float(np.mean(each)) / len(away) for person, each in away.items()}
    other = [distance(figure, now.get((what, figure)), of) > SAME for (what, figure), of in usual.items()]
    return Answer(name, factor, sum(by_person.values()), float(np.mean(other)), len(other), by_person)


@cache
def real_people(keep: Path) -> tuple[Real, ...]:
    """Of the recorded persons."""
    return tuple(middles(by_activity(recorded(keep / "rec"))))


@cache
def made_up_people(number: Number | None, factor: float, activities: tuple[str, ...]) -> Figures:
    """Figures with a number at another value."""
    asks = {"activities": activities}
    return {(what, name): of for what, name, of in answer_with(number, factor, figures_of, asks)}


def answer(keep: Path, name: str, factor: float, number: Number | None) -> Answer:
    """Of one value; no number: all as usual."""
    activities = activities_of(name)
    usual = made_up_people(None, 1.0, activities)
    try:
        now = made_up_people(number, factor, activities)
    except NoAnswerError as error:
        print(f"{name} × {factor:g}: {error}", flush=True)
        return Answer(name, factor, float("nan"), float("nan"))
    return judged(name, factor, now, usual, real_people(keep))


def page(answers: Sequence[Answer], usual: Mapping[str, Answer]) -> str:
    """The whole page.

    Args:
        answers: of half and double of each number.
        usual: with it as it is, by its name.
    """

    def words(one: Answer) -> str:
        if not one.of:
            return f"× {one.factor:g}: nobody can move so"
        before = usual[one.setting].wrong
        return f"× {one.factor:g}: {one.wrong:.2f} for {before:.2f}, {100 * one.changed:.0f} % change"

    rows = judged_tables(answers, usual.__getitem__, place_of_number, words)
    return "\n".join([INTRODUCTION, rules(), "", *rows])


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.made_up_settings", description=__doc__)
    parser.add_argument("--keep", type=Path, required=True, help="folder of fits, motions and answers")
    keep: Path = parser.parse_args().keep
    numbers = [one for one in tuned_numbers(("simulate/",)) if one.name not in NOT_ASKED]
    waiting = ((one.called, factor, one) for one in numbers for factor in (1.0, *FACTORS))
    told = asked(
        keep / "made_up.jsonl", waiting, lambda v: answer(keep, v[0], v[1], None if v[1] == 1.0 else v[2])
    )
    still_asked = {one.called for one in numbers}  # what is kept may be of numbers that are gone
    usual = {one.setting: one for one in told if one.factor == 1.0}
    others = [one for one in told if one.factor != 1.0 and one.setting in still_asked]
    PAGE.write_text(page(others, usual), encoding="utf-8")


if __name__ == "__main__":
    main()
