"""What a constant of the diagnosis decides: each halved and doubled, judged by effects hidden in simulations.

    python -m benchmarks.diagnosis_constants --out DIR

Cases of the public benchmark's kind, of a draw of their own, with one effect of the list each, with what is
on no list, or with nothing. A constant of an effect's file is asked about the cases in which that effect is
hidden, or is told with 1 % and more, and about some of the others; all other constants about a choice of
each kind. What comes before the search (the fit) is kept where a constant has no part in it. Answers are
kept as lines of a file in DIR: it picks up where it was stopped, then writes DIAGNOSIS_CONSTANTS.md.
"""

import argparse
import functools
import json
import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hidden.classes import SOMETHING_ELSE
from benchmarks.hidden.making import make
from benchmarks.hidden.rows.ours import answer_of, public
from benchmarks.hidden.scorer import CLEAN, INSIDE, OUTSIDE, read_truths
from benchmarks.register import tuned_numbers
from benchmarks.rewriting import ROOM, NoAnswerError, Number, answer_with, scaled
from benchmarks.varied import (
    FACTORS,
    LOOK,
    NOTHING,
    STANDS,
    Answer,
    asked,
    place_of_number,
    under_headings,
    variations,
)
from solver.capture.atomic import write_whole
from solver.capture.subject import open_subject
from solver.diagnosis.balance import Balance
from solver.diagnosis.diagnose import diagnosis_from, looked_at
from solver.diagnosis.report import as_json
from solver.diagnosis_settings import DiagnosisSettings
from solver.progress import silent
from solver.settings import settings_for

MODULE = "benchmarks.diagnosis_constants"
PAGE = Path(__file__).with_name("DIAGNOSIS_CONSTANTS.md")
COUNT, SEED = 120, 20261201
OTHERS = {INSIDE: 2, OUTSIDE: 1, CLEAN: 1}  # asked about each constant of an effect, beside its own cases
CHOICE = {INSIDE: 8, OUTSIDE: 2, CLEAN: 2}  # asked about any other
KEPT_CASES = {INSIDE: COUNT // 3, OUTSIDE: 8, CLEAN: 8}
TOLD = 0.01  # an effect with that chance has a say in a case
SAME, BETTER = 0.005, 0.02  # of a probability; of the mean probability of what is right
BEFORE = (  # have a part in what comes before the search
    "effects/marker_", "effects/segment_dis", "effects/leaps", "effects/soft_tissue", "diagnosis/witnesses/",
    "diagnosis/marker_causes", "diagnosis/rows", "diagnosis/scenes",
)  # fmt: skip
BEFORE_SETTINGS = (
    "window_s", "hop_s", "most_rows", "end_s", "force_noise_N", "moment_noise_Nm", "model_", "slack",
)  # fmt: skip
REFUSED = "Cannot be so"
INTRODUCTION = """# What a constant of the diagnosis decides: each halved and doubled

Made by `python -m benchmarks.diagnosis_constants`: {cases} cases with one effect of the list each, one that
is on no list, or none. A constant of an effect's file was asked about its own cases and {others} others,
any other about {choice}. Of a cause's entry (`ABOUT`) the odds and sizes are changed together. A row has, at
half and at double, how much more probability the right name gets (mean of the cases), and in how many cases
the answer is another one.

*Decides nothing here*: no probability changes by more than {same:g} %. *Stands*: some do, and neither gives
the right names {better:g} % more. *Asks for a look*: one of them does, on few cases. *Cannot be so*: with
neither there was an answer.
"""


@dataclass(frozen=True)
class Question:
    """One constant at another value, and the cases that it is asked about."""

    number: Number | None  # None: a setting, or as usual
    setting: str | None
    factor: float
    cases: tuple[str, ...]

    @property
    def name(self) -> str:
        """As the answers' file has it."""
        return self.setting or (self.number.called if self.number else "usual")

    @property
    def from_the_files(self) -> bool:
        """Whether what comes before the search has to be made anew."""
        if self.number is not None:
            return self.number.file.startswith(BEFORE)
        return self.setting is not None and self.setting.split(".")[1].startswith(BEFORE_SETTINGS)


class Cases:
    """What was made, and what is told of it usually."""

    def __init__(self, out: Path) -> None:
        self.out = out
        make(out / "cases", out / "truth", COUNT, SEED)
        self.truths = read_truths(out / "truth")
        of = {group: [c for c, t in self.truths.items() if t["group"] == group] for group in KEPT_CASES}
        self.of = {group: tuple(cases[: KEPT_CASES[group]]) for group, cases in of.items()}
        self.all = tuple(sorted(sum(self.of.values(), ())))

    @functools.cached_property
    def usual(self) -> Mapping[str, Mapping[str, float]]:
        """Probabilities by case; asked once."""
        file = self.out / "usual.json"
        if not file.exists():
            found = told(self.out, Question(None, None, 1.0, self.all))
            write_whole(file, json.dumps(found) + "\n")
        return json.loads(file.read_text(encoding="utf-8"))

    def chosen(self, effects: Sequence[str], some: Mapping[str, int]) -> tuple[str, ...]:
        """Those of some effects, and as many of each group as asked for, evenly spread."""
        own = [c for c in self.all if self._has(c, effects)]
        others = [
            cases[k]
            for group, cases in self.of.items()
            for k in np.linspace(0, len(cases) - 1, some[group]).astype(int)
        ]
        return tuple(sorted({*own, *others}))

    def _has(self, case: str, effects: Sequence[str]) -> bool:
        hidden = [effect["id"] for effect in self.truths[case]["effects"]]
        said = {name for name, chance in self.usual[case].items() if chance >= TOLD}
        return any(e in hidden or (public(e) in said and public(e) != SOMETHING_ELSE) for e in effects)

    def right(self, answers: Mapping[str, Mapping[str, float]]) -> float:
        """The mean probability of what is right."""
        each = [sum(of.get(n, 0.0) for n in self.truths[c]["accepted"]) for c, of in answers.items()]
        return float(np.mean(each))


def questions(cases: Cases) -> Iterator[Question]:
    """Half and double of every tuned constant, effects first."""
    for number in (*tuned_numbers(("effects/",)), *tuned_numbers(("diagnosis/",))):
        own = _effects_of(number.file)
        which = cases.chosen(own, OTHERS) if own else cases.chosen((), CHOICE)
        yield from (Question(number, None, factor, which) for factor in FACTORS)
    for name, factor, _ in variations(DiagnosisSettings()):
        if "." in name:  # the first is all as usual
            yield Question(None, name, factor, cases.chosen((), CHOICE))


def _effects_of(file: str) -> tuple[str, ...]:
    """The causes whose entry stands in a file."""
    text = (ROOM / file).read_text(encoding="utf-8")
    return tuple(part.split('"', 1)[0] for part in text.split('ABOUT = About(\n    id="')[1:])


def told(out: Path, question: Question) -> dict[str, dict[str, float]]:
    """Probabilities by case.

    Raises:
        NoAnswerError: that value cannot be.
    """
    asks = {"out": str(out), "cases": question.cases, "anew": question.from_the_files}
    if question.setting is not None:
        asks |= {"setting": question.setting.split(".")[1], "factor": question.factor}
    return dict(answer_with(question.number, question.factor, probabilities, asks))


def probabilities(
    out: str, cases: Sequence[str], *, anew: bool, setting: str | None = None, factor: float = 1.0
) -> dict[str, dict[str, float]]:
    """By case, in this process.

    Args:
        out: folder of the cases.
        cases: their names.
        anew: make what comes before the search anew; else it is taken, or kept, where it lies.
        setting: of the diagnosis, which is another one.
        factor: times its value.
    """
    return {case: _probabilities(Path(out), case, anew, setting, factor) for case in cases}


def _probabilities(out: Path, case: str, anew: bool, setting: str | None, factor: float) -> dict[str, float]:
    folder, kept = out / "cases" / case, out / "kept" / f"{case}.pickle"
    settings = settings_for(folder)
    if setting is not None:
        value = scaled(getattr(settings.diagnosis, setting), factor)
        settings = replace(settings, diagnosis=replace(settings.diagnosis, **{setting: value}))
    if kept.exists() and not anew:
        found = pickle.loads(kept.read_bytes())
        if setting is not None:
            found = replace(found, balance=Balance(found.balance.trials, settings.diagnosis))
    else:
        subject = open_subject(folder, settings.reading)
        found = looked_at(subject, settings, trials=None, reviews={}, progress=silent)
        if not anew:
            kept.parent.mkdir(exist_ok=True)
            kept.write_bytes(pickle.dumps(found))
    return dict(answer_of(as_json(diagnosis_from(found)))["probabilities"])


def answered(cases: Cases, question: Question) -> Answer:
    """The probability that is missing of what is right, against usual; and what is answered otherwise."""
    try:
        found = told(cases.out, question)
    except NoAnswerError as error:
        print(f"{question.name} × {question.factor:g}: {error}", flush=True)
        return Answer(question.name, question.factor, float("nan"), float("nan"))
    before = {case: cases.usual[case] for case in found}
    changed = [
        max(abs(now.get(name, 0.0) - before[case].get(name, 0.0)) for name in {*now, *before[case]}) > SAME
        for case, now in found.items()
    ]
    lost = cases.right(before) - cases.right(found)
    return Answer(question.name, question.factor, lost, float(np.mean(changed)), len(found))


def heading(half: Answer, double: Answer) -> str:
    """Under which a constant stands."""
    both = [one for one in (half, double) if one.of]
    if not both:
        return REFUSED
    if len(both) == 2 and not any(one.changed for one in both):
        return NOTHING
    return LOOK if min(one.wrong for one in both) < -BETTER else STANDS


def page(answers: Sequence[Answer], count: int) -> str:
    """The whole page."""
    kinds = (NOTHING, STANDS, LOOK, REFUSED)
    rows = under_headings(answers, lambda _, both: heading(both[0.5], both[2.0]), _place, _words, kinds)
    words = INTRODUCTION.format(
        cases=count,
        others=sum(OTHERS.values()),
        choice=sum(CHOICE.values()),
        same=100 * SAME,
        better=100 * BETTER,
    )
    return "\n".join([words, *rows])


def _place(name: str) -> str:
    return place_of_number(name) if " " in name else f"`diagnosis.{name.split('.')[1]}` | `{name}`"


def _words(one: Answer) -> str:
    if not one.of:
        return f"× {one.factor:g}: no answer"
    return f"× {one.factor:g}: {-100 * one.wrong:+.1f} %, {one.changed * one.of:.0f} of {one.of} otherwise"


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    parser = argparse.ArgumentParser(prog=f"python -m {MODULE}", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of cases and answers")
    parser.add_argument("--workers", type=int, default=1, help="processes at once")
    given: Any = parser.parse_args()
    cases = Cases(given.out)
    variations = ((q.name, q.factor, q) for q in questions(cases))
    answers = asked(given.out / "answers.jsonl", variations, lambda v: answered(cases, v[2]), given.workers)
    PAGE.write_text(page(answers, len(cases.all)), encoding="utf-8")


if __name__ == "__main__":
    main()
