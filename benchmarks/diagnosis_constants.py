"""What a constant of the diagnosis decides: each halved and doubled, judged by effects hidden in simulations.

    python -m benchmarks.diagnosis_constants --out DIR

Cases of the public benchmark's kind, of a draw of their own, with one effect of the list each, with what is
on no list, or with nothing. A constant of an effect's file is asked about the cases in which that effect is
hidden, or is told with 1 % and more, and about some of the others; all other constants about a choice of
each kind. The fit of the markers as they were recorded is kept, and what witnesses say and all that comes
before the search where a constant has no part in it: what has is watched. Answers are kept as lines of a file
in DIR: it picks up where it was stopped, then writes DIAGNOSIS_CONSTANTS.md.
"""

import argparse
import json
import pickle
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from types import FrameType
from typing import Any
from unittest import mock

import numpy as np

from benchmarks.hidden.classes import SOMETHING_ELSE
from benchmarks.hidden.making import make
from benchmarks.hidden.rows.ours import answer_of, public
from benchmarks.hidden.scorer import CLEAN, INSIDE, OUTSIDE, read_truths
from benchmarks.register import tuned_numbers
from benchmarks.rewriting import ROOM, NoAnswerError, Number, answer_with
from benchmarks.settings_sweep import watched
from benchmarks.varied import (
    FACTORS,
    LOOK,
    NOTHING,
    REFUSED,
    STANDS,
    Answer,
    asked,
    place_of_number,
    under_headings,
)
from solver.capture.atomic import write_whole
from solver.capture.capture import Capture
from solver.capture.subject import open_subject
from solver.diagnosis import diagnose
from solver.diagnosis.balance import Balance
from solver.diagnosis.diagnose import LookedAt, diagnosis_from, looked_at
from solver.diagnosis.report import as_json
from solver.diagnosis.witnesses.settings import WITNESSES
from solver.diagnosis.witnesses.statement import Statement
from solver.fit import Fit
from solver.progress import silent
from solver.settings import Settings, settings_for

MODULE = "benchmarks.diagnosis_constants"
PAGE = Path(__file__).with_name("DIAGNOSIS_CONSTANTS.md")
COUNT, SEED = 120, 20261201
OTHERS = {INSIDE: 2, OUTSIDE: 1, CLEAN: 1}  # asked about each constant of an effect, beside its own cases
CHOICE = {INSIDE: 8, OUTSIDE: 2, CLEAN: 2}  # asked about any other
KEPT_CASES = {INSIDE: COUNT // 3, OUTSIDE: 8, CLEAN: 8}
TOLD = 0.01  # an effect with that chance has a say in a case
SAME, BETTER = 0.005, 0.02  # of a probability; of the mean probability of what is right
ROOMS = ("effects/", "diagnosis/", "diagnosis_settings.py", "dynamics/marker_noise.py")
WITNESS_ROOM = "diagnosis/witnesses/"
TABLES = {"DiagnosisSettings": "diagnosis", "MarkerNoise": "diagnosis.markers"}  # in settings' files
BEFORE, WITNESSES_SAY = "before the search", "witnesses"  # parts of a diagnosis that are kept
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

    number: Number | None  # None: as usual
    factor: float
    cases: tuple[str, ...]
    anew: tuple[str, ...] = ()  # kept parts in which it is at work

    @property
    def name(self) -> str:
        """As the answers' file has it."""
        return self.number.called if self.number else "usual"


class Cases:
    """What was made, and what is told of it usually."""

    def __init__(self, out: Path) -> None:
        self.out = out
        make(out / "cases", out / "truth", COUNT, SEED)
        self.truths = read_truths(out / "truth")
        of = {group: [c for c, t in self.truths.items() if t["group"] == group] for group in KEPT_CASES}
        self.of = {group: tuple(cases[: KEPT_CASES[group]]) for group, cases in of.items()}
        self.all = tuple(sorted(sum(self.of.values(), ())))

    @cached_property
    def usual(self) -> Mapping[str, Mapping[str, float]]:
        """Probabilities by case; asked once."""
        file = self.out / "usual.json"
        if not file.exists():
            found = told(self.out, Question(None, 1.0, self.all))
            write_whole(file, json.dumps(found) + "\n")
        return json.loads(file.read_text(encoding="utf-8"))

    @cached_property
    def at_work(self) -> Mapping[str, frozenset[str]]:
        """Files, and settings by class and name, by the kept part that they are used in."""
        file = self.out / "at_work.json"
        if not file.exists():
            used = at_work(self.out, self.chosen((), CHOICE))
            write_whole(file, json.dumps({part: sorted(names) for part, names in used.items()}) + "\n")
        kept = json.loads(file.read_text(encoding="utf-8"))
        return {part: frozenset(names) for part, names in kept.items()}

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
    """Half and double of every tuned constant and setting, effects first."""
    for number in tuned_numbers(ROOMS, settings=True):
        own = _effects_of(number.file)
        which = cases.chosen(own, OTHERS) if own else cases.chosen((), CHOICE)
        anew = {part for part, used in cases.at_work.items() if {number.file, number.name} & used}
        if number.file.startswith(WITNESS_ROOM):  # nobody watches its settings
            anew.add(WITNESSES_SAY)
        yield from (Question(number, factor, which, tuple(sorted(anew))) for factor in FACTORS)


def _effects_of(file: str) -> tuple[str, ...]:
    """The causes whose entry stands in a file."""
    text = (ROOM / file).read_text(encoding="utf-8")
    return tuple(part.split('"', 1)[0] for part in text.split('ABOUT = About(\n    id="')[1:])


def told(out: Path, question: Question) -> dict[str, dict[str, float]]:
    """Probabilities by case.

    Raises:
        NoAnswerError: that value cannot be.
    """
    asks = {"out": str(out), "cases": question.cases, "anew": question.anew}
    return dict(answer_with(question.number, question.factor, probabilities, asks))


def probabilities(out: str, cases: Sequence[str], *, anew: Sequence[str]) -> dict[str, dict[str, float]]:
    """By case, in this process.

    Args:
        out: folder of the cases.
        cases: their names.
        anew: parts that are made anew; others are taken, or kept, where they lie.
    """
    return {case: _probabilities(Path(out), case, anew) for case in cases}


def _probabilities(out: Path, case: str, anew: Sequence[str]) -> dict[str, float]:
    settings = settings_for(out / "cases" / case)
    found = _kept(out / "kept" / case, BEFORE, anew, lambda: _looked_at(out, case, settings))
    trials = [replace(one, settings=WITNESSES) for one in found.measured]
    found = replace(found, measured=trials)
    if found.balance.settings != settings.diagnosis:
        found = replace(found, balance=Balance(found.balance.trials, settings.diagnosis))
    said = _kept(out / "kept" / case, WITNESSES_SAY, anew, lambda: asked_of(found))
    with mock.patch.object(diagnose, "asked", return_value=said):
        return dict(answer_of(as_json(diagnosis_from(found)))["probabilities"])


def asked_of(found: LookedAt) -> Sequence[Statement]:
    """What all witnesses say."""
    return diagnose.asked(found.measured, found.entered_mass_kg)


def _kept(folder: Path, part: str, anew: Sequence[str], made: Callable[[], Any]) -> Any:
    file = folder / f"{part}.pickle"
    if part in anew:
        return made()
    if not file.exists():
        folder.mkdir(parents=True, exist_ok=True)
        file.write_bytes(pickle.dumps(made()))
    return pickle.loads(file.read_bytes())


def _looked_at(out: Path, case: str, settings: Settings) -> LookedAt:
    """All that comes before the search; the markers' fit as recorded, which nothing here changes, is kept."""

    def kept(*given: Any, captures: Mapping[str, Capture], **named: Any) -> Fit:
        def fit() -> Fit:
            return solve(*given, captures=captures, **named)

        return fit() if captures else _kept(out / "kept" / case, "fit", (), fit)  # captures: repaired ones

    subject, solve = open_subject(out / "cases" / case, settings.reading), diagnose.solve
    with mock.patch.object(diagnose, "solve", kept):
        return looked_at(subject, settings, trials=None, reviews={}, progress=silent)


def at_work(out: Path, cases: Sequence[str]) -> dict[str, set[str]]:
    """Files of the solver and settings, by class and name, by the kept part of some cases that they serve."""
    found: dict[str, set[str]] = {BEFORE: set(), WITNESSES_SAY: set()}
    for case in cases:
        settings = settings_for(out / "cases" / case)
        looked = _used(found[BEFORE], partial(_looked_at, out, case, settings))
        _used(found[WITNESSES_SAY], partial(asked_of, looked))
    return found


def _used(names: set[str], work: Callable[[], LookedAt | Sequence[Statement]]) -> Any:
    """What a piece of work makes, and to the names those that it uses."""
    codes = set()

    def called(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            codes.add(frame.f_code.co_filename)

    with watched() as used:
        sys.setprofile(called)
        try:
            made = work()
        finally:
            sys.setprofile(None)
    names |= {str(Path(code).relative_to(ROOM)) for code in codes if code.startswith(f"{ROOM}/")}
    names |= {f"{kind.__name__}.{name}" for kind, name in used}
    return made


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
    file, _, called = name.partition(" ")
    kind, _, setting = called.partition(".")
    if not setting:
        return place_of_number(name)
    return f"`{f'{TABLES[kind]}.{setting}' if kind in TABLES else file.removesuffix('.py')}` | `{called}`"


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
