"""Settings halved and doubled where the right answer is known: what each of them decides, in words."""

import json
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float
from scipy.stats import false_discovery_control

FACTORS = (0.5, 2.0)
SAME_SHARE, BETTER_SHARE = 0.001, 0.02
ROUNDING = 1e-9  # smaller differences are none
NOTHING, STANDS, CHANCE, LOOK = "Decides nothing here", "Stands", "May be chance", "Asks for a look"
REFUSED = "Cannot be so"  # with neither value there is an answer
MOST_EXACT, DRAWN = 18, 100_000
FALSE_SHARE = 0.1  # of the values of a page that are called better beyond chance
RULES = """*Decides nothing here*: with neither do 0.1 % of the answers change, and as many are wrong within
2 %. *Stands*: something changes, and neither makes fewer answers wrong by more than 2 % of those that are.
*Asks for a look*: one of them does, beyond chance. *May be chance*: one of them does, and not beyond chance.

Answers about one {unit} depend on each other, so each {unit} counts once. Were the other value no better, it
might as well have been the usual one, {unit} by {unit}: *p* is the share of all such exchanges that leave it
as much better as it is, or more. Many values are asked, and some are better by chance: *q* is the share of
such to be expected among it and all that are as surely better (Benjamini and Hochberg, over the page), and
beyond chance is a *q* of at most {false:g} %. A value with which too few differ for that, however they do, is
left out of the count (Tarone 1990, Gilbert 2005) and has no *q*."""


def rules(unit: str = "person") -> str:
    """How a page sorts its rows.

    Args:
        unit: what counts once.
    """
    return RULES.format(unit=unit, false=100 * FALSE_SHARE)


@dataclass(frozen=True)
class Answer:
    """What came of one value of one setting."""

    setting: str  # "DetectionSettings.confidence"
    factor: float
    wrong: float  # share of what was asked
    changed: float  # share of what is answered otherwise than with the usual settings
    of: int = 0  # answers
    by_person: Mapping[str, float] = field(default_factory=dict)  # what each has in `wrong`: together it is


Variation = tuple[str, float, Any]
"""Name, factor, and the settings with it."""


def variations(
    usual: Any, left_out: tuple[str, ...] = (), shares: tuple[str, ...] = ()
) -> Iterator[Variation]:
    """The usual ones, then half and double of every number that is not zero.

    Args:
        usual: a frozen dataclass of settings.
        left_out: names that the cases cannot show; those that begin with one where it ends in "_".
        shares: names of those that double would make larger than one: it halves what is missing to one.
    """
    kind = type(usual).__name__
    yield kind, 1.0, usual
    for one in fields(usual):
        value = getattr(usual, one.name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not value:
            continue
        if any(one.name == name or (name[-1] == "_" and one.name.startswith(name)) for name in left_out):
            continue
        for factor in FACTORS:
            other = factor * value if isinstance(value, float) else max(1, int(factor * value))
            if one.name in shares and factor > 1:
                other = 1 - (1 - value) / factor
            yield f"{kind}.{one.name}", factor, replace(usual, **{one.name: other})


class Case(Protocol):
    """Something that settings answer questions about, of which the right answers are known."""

    @property
    def person(self) -> str: ...

    @property
    def truth(self) -> Sequence[object]: ...

    def answers(self, settings: Any) -> Sequence[object]: ...


class Questions:
    """All cases of one table of settings."""

    def __init__(
        self, usual: Any, cases: Callable[[], Iterable[Case]], left_out: tuple[str, ...] = ()
    ) -> None:
        self.usual, self.left_out = usual, left_out
        self._make = cases

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """Made when they are first asked for."""
        return tuple(self._make())

    @cached_property
    def _usually(self) -> list[Sequence[object]]:
        return [case.answers(self.usual) for case in self.cases]

    def answer(self, variation: Variation) -> Answer:
        """Of one value: the share of answers that are wrong, and that are others than usual."""
        name, factor, settings = variation
        return self.judged(name, factor, [case.answers(settings) for case in self.cases])

    def judged(self, name: str, factor: float, told: Sequence[Sequence[object]]) -> Answer:
        """Of what was told of all cases otherwise than by settings.

        Args:
            name: of what was changed.
            factor: times its value.
            told: of each case.
        """
        every: dict[str, list[tuple[bool, bool]]] = {}
        for case, now, usually in zip(self.cases, told, self._usually, strict=True):
            every.setdefault(case.person, []).extend(
                (one != right, one != before)
                for one, right, before in zip(now, case.truth, usually, strict=True)
            )
        count = sum(map(len, every.values()))
        wrong, changed = (
            {person: sum(one[k] for one in of_person) / count for person, of_person in every.items()}
            for k in range(2)
        )
        return Answer(name, factor, sum(wrong.values()), sum(changed.values()), count, wrong)


def kept_answers(file: Path) -> list[Answer]:
    """Those of a file that `asked` wrote, if there is one."""
    return [Answer(**json.loads(line)) for line in file.read_text().splitlines()] if file.exists() else []


def asked(
    file: Path, waiting: Iterable[Variation], answer: Callable[[Variation], Answer], workers: int = 1
) -> list[Answer]:
    """All answers; those that the file has are not asked again, and new ones are added to it.

    Args:
        file: a line an answer.
        waiting: what is to be asked.
        answer: of one.
        workers: threads that ask at once.
    """
    kept = kept_answers(file)
    known = {(one.setting, one.factor) for one in kept}
    file.parent.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(workers) as pool:
        for new in pool.map(answer, (one for one in waiting if one[:2] not in known)):
            kept.append(new)
            with file.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(asdict(new)) + "\n")
            print(f"{new.setting}: {shares(new)}", flush=True)
    return kept


@dataclass(frozen=True)
class Evidence:
    """How far one value is better for persons, and not by chance."""

    better: int  # persons of whom fewer answers are wrong
    differ: int  # persons of whom more or fewer are
    gain: float  # by how much less is wrong
    p: float  # share of exchanges by which it is as much better
    q: float | None  # share by chance of it and what is as surely better; None: too few persons differ

    @property
    def is_beyond_chance(self) -> bool:
        """Also among as many questions."""
        return self.q is not None and self.q <= FALSE_SHARE

    @property
    def words(self) -> str:
        """For a cell."""
        among = "" if self.q is None else f", q {100 * self.q:.1f} %"
        return f"better for {self.better} of {self.differ} that differ, p {100 * self.p:.1f} %{among}"


def evidence(answers: Sequence[Answer], usual: Callable[[str], Answer]) -> dict[tuple[str, float], Evidence]:
    """Of every value of a page, by name and factor.

    Args:
        answers: of half and double of each.
        usual: with all as they are, by the name of what is varied.
    """
    gains = {(one.setting, one.factor): _gains(one, usual(one.setting)) for one in answers}
    p = {name: chance_of(of_persons) for name, of_persons in gains.items()}
    least = {name: 0.5 ** len(of_persons) for name, of_persons in gains.items()}
    rank = 1
    while sum(one <= FALSE_SHARE / rank for one in least.values()) > rank:
        rank += 1
    counted = [name for name, one in least.items() if one <= FALSE_SHARE / rank]
    q = dict(zip(counted, false_discovery_control([p[name] for name in counted]), strict=True))
    return {
        name: Evidence(
            int((of > 0).sum()), len(of), float(of.sum()), p[name], float(q[name]) if name in q else None
        )
        for name, of in gains.items()
    }


def _gains(other: Answer, usual: Answer) -> Float[np.ndarray, " persons"]:
    """By how much less is wrong, of each person of whom it is more or less."""
    each = np.array([usual.by_person[person] - of_other for person, of_other in other.by_person.items()])
    return each[np.abs(each) > ROUNDING]


def chance_of(gains: Float[np.ndarray, " persons"]) -> float:
    """The share of all choices of signs by which a sum is as large as it is, or larger.

    Args:
        gains: of each person, none of them zero; of more than `MOST_EXACT` some choices are drawn.
    """
    as_much = gains.sum() - ROUNDING * np.abs(gains).sum()
    if len(gains) > MOST_EXACT:
        signs = np.random.default_rng(0).choice([-1.0, 1.0], (DRAWN, len(gains)))
        return float((1 + np.sum(signs @ gains >= as_much)) / (1 + DRAWN))
    sums = np.zeros(1)
    for gain in gains:
        sums = np.concatenate([sums - gain, sums + gain])
    return float(np.mean(sums >= as_much))


def verdict(half: Answer, double: Answer, usual: Answer, beyond_chance: Container[float]) -> str:
    """Under which heading a setting stands.

    Args:
        half: with half of it.
        double: with double.
        usual: as it is.
        beyond_chance: factors with which it is better not only by chance.
    """
    fewer = {one.factor: usual.wrong - one.wrong for one in (half, double)}
    least = BETTER_SHARE * usual.wrong
    if max(half.changed, double.changed) < SAME_SHARE and max(map(abs, fewer.values())) <= least:
        return NOTHING
    better = [factor for factor, less in fewer.items() if less > least]
    if any(factor in beyond_chance for factor in better):
        return LOOK
    return CHANCE if better else STANDS


def usual_of(answers: Sequence[Answer]) -> dict[str, Answer]:
    """What is wrong with the usual settings, by their class."""
    return {one.setting: one for one in answers if "." not in one.setting}


def tables(answers: Sequence[Answer], table_of: Mapping[str, str]) -> list[str]:
    """Lines of a page: the settings under their headings, in the order of their names.

    Args:
        answers: of the usual settings, and of half and double of each.
        table_of: how a TOML file names each class's table.
    """
    varied = [one for one in answers if "." in one.setting]
    usual = usual_of(answers)
    return judged_tables(varied, lambda name: usual[_class(name)], lambda name: place(name, table_of))


def number_tables(answers: Sequence[Answer], usual: Answer) -> list[str]:
    """The same of constants of modules, called by file and name.

    Args:
        answers: of half and double of each.
        usual: with all as they are.
    """
    return judged_tables(answers, lambda _: usual, place_of_number)


def shares(one: Answer) -> str:
    """What a cell says of one value: shares that are wrong and that are others than usual."""
    return f"× {one.factor:g}: {100 * one.wrong:.2f} %, {100 * one.changed:.2f} % otherwise"


def judged_tables(
    answers: Sequence[Answer],
    usual: Callable[[str], Answer],
    cells: Callable[[str], str],
    words: Callable[[Answer], str] = shares,
) -> list[str]:
    """Lines of a page: rows under the headings of `verdict`, with what is said of chance where one is better.

    Args:
        answers: of half and double of each; of a value that cannot be, one of nothing.
        usual: with all as they are, by the name of what is varied.
        cells: the first two of a row, by its name.
        words: what is said of one answer.
    """
    found = evidence(answers, usual)

    def heading(name: str, both: Mapping[float, Answer]) -> str:
        told = [one for one in both.values() if not np.isnan(one.wrong)]
        surely = {factor for factor in both if found[name, factor].is_beyond_chance}
        return verdict(told[0], told[-1], usual(name), surely) if told else REFUSED

    def with_chance(one: Answer) -> str:
        before = usual(one.setting).wrong
        is_better = before - one.wrong > BETTER_SHARE * before
        return words(one) + (f" ({found[one.setting, one.factor].words})" if is_better else "")

    kinds = (NOTHING, STANDS, CHANCE, LOOK, *([REFUSED] if any(np.isnan(a.wrong) for a in answers) else []))
    return under_headings(answers, heading, cells, with_chance, kinds)


def place(name: str, table_of: Mapping[str, str]) -> str:
    """The first two cells of a row.

    Args:
        name: of a setting by its class, of a constant by its file.
        table_of: of each class, how a TOML file names it.
    """
    if " " in name:
        return place_of_number(name)
    return f"`{table_of[_class(name)]}.{name.partition('.')[2]}` | `{name}`"


def _class(name: str) -> str:
    return name.partition(".")[0]


def place_of_number(name: str) -> str:
    """The first two cells of a constant's row, by its file and name."""
    file, _, constant = name.partition(" ")
    return f"`{file}` | `{constant}`"


def under_headings(
    answers: Sequence[Answer],
    heading: Callable[[str, Mapping[float, Answer]], str],
    place: Callable[[str], str],
    words: Callable[[Answer], str] = shares,
    headings: Sequence[str] = (NOTHING, STANDS, CHANCE, LOOK),
) -> list[str]:
    """Lines of a page: what has both answers, in the order of names.

    Args:
        answers: of half and double of each.
        heading: of one, by its name and its answers by factor.
        place: its first two cells.
        words: what is said of one answer.
        headings: in the page's order.
    """
    by_name: dict[str, dict[float, Answer]] = {}
    for one in answers:
        by_name.setdefault(one.setting, {})[one.factor] = one
    lines: list[str] = []
    for kind in headings:
        rows = [
            f"| {place(name)} | {'; '.join(words(both[f]) for f in FACTORS)} |"
            for name, both in sorted(by_name.items())
            if len(both) == len(FACTORS) and heading(name, both) == kind
        ]
        lines += [f"## {kind}: {len(rows)}", "", "| setting or file | in the code | half and double |"]
        lines += ["|---|---|---|", *rows, ""]
    return lines
