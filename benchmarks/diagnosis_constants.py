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
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
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
    CHANCE,
    FACTORS,
    FALSE_SHARE,
    LOOK,
    NOTHING,
    REFUSED,
    STANDS,
    Answer,
    Evidence,
    asked,
    evidence,
    kept_answers,
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
TOGETHER = 6  # numbers that are asked about at once, before those that change something are alone
ROOMS = ("effects/", "diagnosis/", "diagnosis_settings.py", "dynamics/marker_noise.py")
WITNESS_ROOM = "diagnosis/witnesses/"
TABLES = {"DiagnosisSettings": "diagnosis", "MarkerNoise": "diagnosis.markers"}  # in settings' files
BEFORE, WITNESSES_SAY = "before the search", "witnesses"  # parts of a diagnosis that are kept
INTRODUCTION = """# What a constant of the diagnosis decides: each halved and doubled

Made by `python -m benchmarks.diagnosis_constants`: {cases} cases with one effect of the list each, one that
is on no list, or none. A constant of an effect's file was asked about its own cases and {others} others,
any other about {choice}. Of a cause's entry (`ABOUT`) the odds and sizes are changed together. A row has, at
half and at double, how much more probability the right name gets (mean of the cases), and in how many cases
the answer is another one. Up to {together} constants were changed at once first: a case in which that changes
nothing was taken as unchanged for each of them.

*Decides nothing here*: no probability changes by more than {same:g} %. *Stands*: some do, and neither gives
the right names {better:g} % more. What did was asked about all {cases} cases, each of which counts once. Were
the other value no better there, it might as well have been the usual one, case by case: *p* is the share of
all such exchanges that leave it as much better as it is, or more, and *q* the share by chance among it and
what is as surely better (Benjamini and Hochberg, over those asked; none where too few cases differ). *Asks
for a look*: *q* is at most {false:g} %. *May be chance*: it is better there, and not so surely; if it is
not better there, it stands. *Cannot be so*: with neither value there was an answer.
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

    @property
    def key(self) -> tuple[str, float]:
        """What it is known by."""
        return self.name, self.factor


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
            found = told(self.out, [Question(None, 1.0, self.all)], self.all)
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

    def is_changed(self, case: str, now: Mapping[str, float]) -> bool:
        """Whether another probability is told than usually."""
        before = self.usual[case]
        return max(abs(now.get(name, 0.0) - before.get(name, 0.0)) for name in {*now, *before}) > SAME

    def right(self, case: str, answer: Mapping[str, float]) -> float:
        """The probability of what is right."""
        return sum(answer.get(name, 0.0) for name in self.truths[case]["accepted"])


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


def told(out: Path, questions: Sequence[Question], cases: Sequence[str]) -> dict[str, dict[str, float]]:
    """Probabilities by case, with the numbers of all these questions at their other values.

    Args:
        out: folder of the cases.
        questions: alike but for their numbers.
        cases: to be asked.

    Raises:
        NoAnswerError: that value cannot be.
    """
    asks = {"out": str(out), "cases": cases, "anew": questions[0].anew}
    numbers = [one.number for one in questions if one.number]
    return dict(answer_with(numbers, questions[0].factor, probabilities, asks))


def together(questions: Iterable[Question]) -> list[tuple[Question, ...]]:
    """Some at a time that are alike but for their numbers."""
    alike: dict[tuple[object, ...], list[Question]] = {}
    for one in questions:
        alike.setdefault((one.cases, one.anew, one.factor), []).append(one)
    return [tuple(each[k : k + TOGETHER]) for each in alike.values() for k in range(0, len(each), TOGETHER)]


def suspects(cases: Cases, questions: Sequence[Question]) -> tuple[str, ...]:
    """Cases of which something else is told with all these numbers at other values; all, if nothing is."""
    if len(questions) == 1:
        return questions[0].cases
    try:
        found = told(cases.out, questions, questions[0].cases)
    except NoAnswerError:
        return questions[0].cases
    return tuple(case for case, now in found.items() if cases.is_changed(case, now))


def all_suspects(
    cases: Cases, questions: Sequence[Question], workers: int
) -> dict[tuple[str, float], tuple[str, ...]]:
    """Of each question, the cases that it is to be asked about alone; kept in a file."""
    file = cases.out / "together.jsonl"
    lines = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    found = {(name, line["factor"]): tuple(line["cases"]) for line in lines for name in line["settings"]}
    groups = together(one for one in questions if one.key not in found)
    with ThreadPoolExecutor(workers) as pool, file.open("a", encoding="utf-8") as kept:
        for number, (group, to_ask) in enumerate(
            zip(groups, pool.map(partial(suspects, cases), groups), strict=True), start=1
        ):
            found |= {one.key: to_ask for one in group}
            line = {"settings": [one.name for one in group], "factor": group[0].factor, "cases": to_ask}
            kept.write(json.dumps(line) + "\n")
            kept.flush()
            print(f"{number} of {len(groups)} groups: {len(to_ask)} of {len(group[0].cases)}", flush=True)
    return found


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


def answered(cases: Cases, question: Question, alone: Sequence[str]) -> Answer:
    """The probability that is missing of what is right, against usual; and what is answered otherwise.

    Args:
        cases: all.
        question: with half or double.
        alone: cases that it is asked about; others are known to be as usual.
    """
    before = {case: cases.usual[case] for case in question.cases}
    try:
        found = before | (told(cases.out, [question], alone) if alone else {})
    except NoAnswerError as error:
        print(f"{question.name} × {question.factor:g}: {error}", flush=True)
        return Answer(question.name, question.factor, float("nan"), float("nan"))
    changed, count = [case for case, now in found.items() if cases.is_changed(case, now)], len(found)
    lost = dict.fromkeys(found, 0.0) | {
        case: (cases.right(case, before[case]) - cases.right(case, found[case])) / count for case in changed
    }
    return Answer(question.name, question.factor, sum(lost.values()), len(changed) / count, count, lost)


def is_better(one: Answer) -> bool:
    """Whether it gives the right names more."""
    return one.wrong < -BETTER


def heading(both: Sequence[Answer], of_all: Mapping[tuple[str, float], Evidence]) -> str:
    """Under which a constant stands.

    Args:
        both: with half and double.
        of_all: how surely each value is better that was asked about all cases, by name and factor.
    """
    told_of = [one for one in both if one.of]
    if not told_of:
        return REFUSED
    if len(told_of) == 2 and not any(one.changed for one in both):
        return NOTHING
    better = [one for one in told_of if is_better(one)]
    if not better:
        return STANDS
    found = [of_all.get((one.setting, one.factor)) for one in better]
    if any(one is None or one.is_beyond_chance for one in found):
        return LOOK
    return CHANCE if any(one and one.gain > 0 for one in found) else STANDS


def page(answers: Sequence[Answer], again: Sequence[Answer], count: int) -> str:
    """The whole page.

    Args:
        answers: of half and double of each.
        again: of all cases, where one was better.
        count: of all cases.
    """
    same = Answer("usual", 1.0, 0.0, 0.0, by_person={case: 0.0 for one in again for case in one.by_person})
    found = evidence(again, lambda _: same)
    all_cases = {(one.setting, one.factor): one for one in again}

    def words(one: Answer) -> str:
        key = one.setting, one.factor
        of_all = f" (all cases {_words(all_cases[key])}, {found[key].words})" if key in found else ""
        return _words(one) + of_all

    rows = under_headings(
        answers,
        lambda _, both: heading(tuple(both.values()), found),
        _place,
        words,
        (NOTHING, STANDS, CHANCE, LOOK, REFUSED),
    )
    introduction = INTRODUCTION.format(
        cases=count,
        others=sum(OTHERS.values()),
        choice=sum(CHOICE.values()),
        same=100 * SAME,
        better=100 * BETTER,
        together=TOGETHER,
        false=100 * FALSE_SHARE,
    )
    return "\n".join([introduction, *rows])


def _place(name: str) -> str:
    file, _, called = name.partition(" ")
    kind, _, setting = called.partition(".")
    if not setting:
        return place_of_number(name)
    return f"`{f'{TABLES[kind]}.{setting}' if kind in TABLES else file.removesuffix('.py')}` | `{called}`"


def _words(one: Answer) -> str:
    if not one.of:
        return f"× {one.factor:g}: no answer"
    gain = round(-100 * one.wrong, 1) + 0.0  # no minus zero
    return f"× {one.factor:g}: {gain:+.1f} %, {one.changed * one.of:.0f} of {one.of} otherwise"


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    parser = argparse.ArgumentParser(prog=f"python -m {MODULE}", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of cases and answers")
    parser.add_argument("--workers", type=int, default=1, help="processes at once")
    given: Any = parser.parse_args()
    cases, file = Cases(given.out), given.out / "answers.jsonl"
    every = {one.key: one for one in questions(cases)}
    known = {(one.setting, one.factor) for one in kept_answers(file)}
    waiting = [one for key, one in every.items() if key not in known]
    alone = all_suspects(cases, waiting, given.workers)
    variations = ((*one.key, one) for one in waiting)
    answers = asked(file, variations, lambda v: answered(cases, v[2], alone[v[2].key]), given.workers)
    answers = [
        one for one in answers if (one.setting, one.factor) in every
    ]  # kept ones may be of what is gone
    better = [(one.setting, one.factor) for one in answers if one.of and is_better(one)]
    variations = ((*key, replace(every[key], cases=cases.all)) for key in better)
    again = asked(
        given.out / "again.jsonl", variations, lambda v: answered(cases, v[2], cases.all), given.workers
    )
    PAGE.write_text(page(answers, again, len(cases.all)), encoding="utf-8")


if __name__ == "__main__":
    main()
