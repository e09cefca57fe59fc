"""Settings halved and doubled where the right answer is known: what each of them decides, in words."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

FACTORS = (0.5, 2.0)
SAME_SHARE, BETTER_SHARE = 0.001, 0.02
NOTHING, STANDS, LOOK = "Decides nothing here", "Stands", "Asks for a look"
RULES = """*Decides nothing here*: with neither do 0.1 % of the answers change, and as many are wrong within
2 %. *Stands*: something changes, and neither makes fewer answers wrong by more than 2 % of those that are.
*Asks for a look*: one of them does."""
BY_CHANCE = (
    " Fewer wrong answers than that, or than twice the root of those that are otherwise, may be chance."
)


@dataclass(frozen=True)
class Answer:
    """What came of one value of one setting."""

    setting: str  # "DetectionSettings.confidence"
    factor: float
    wrong: float  # share of what was asked
    changed: float  # share of what is answered otherwise than with the usual settings
    of: int = 0  # answers


Variation = tuple[str, float, Any]
"""Name, factor, and the settings with it."""


def variations(usual: Any, left_out: tuple[str, ...] = ()) -> Iterator[Variation]:
    """The usual ones, then half and double of every number that is not zero.

    Args:
        usual: a frozen dataclass of settings.
        left_out: names that the cases cannot show; those that begin with one where it ends in "_".
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
            yield f"{kind}.{one.name}", factor, replace(usual, **{one.name: other})


class Case(Protocol):
    """Something that settings answer questions about, of which the right answers are known."""

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
        told = [case.answers(settings) for case in self.cases]
        every = [
            (one != right, one != before)
            for case, of_case, usually in zip(self.cases, told, self._usually, strict=True)
            for one, right, before in zip(of_case, case.truth, usually, strict=True)
        ]
        wrong, changed = np.mean(every, axis=0)
        return Answer(name, factor, float(wrong), float(changed), len(every))


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
    kept = [Answer(**json.loads(line)) for line in file.read_text().splitlines()] if file.exists() else []
    known = {(one.setting, one.factor) for one in kept}
    file.parent.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(workers) as pool:
        for new in pool.map(answer, (one for one in waiting if one[:2] not in known)):
            kept.append(new)
            with file.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(asdict(new)) + "\n")
            print(new, flush=True)
    return kept


def verdict(half: Answer, double: Answer, usual: Answer, *, by_chance: bool = False) -> str:
    """Under which heading a setting stands.

    Args:
        half: with half of it.
        double: with double.
        usual: as it is.
        by_chance: answers do not depend on each other, so that fewer wrong ones may be chance: twice the
            root of those that are otherwise.
    """
    other = [usual.wrong - half.wrong, usual.wrong - double.wrong]  # fewer, or more where negative
    least = BETTER_SHARE * usual.wrong
    if max(half.changed, double.changed) < SAME_SHARE and max(map(abs, other)) <= least:
        return NOTHING
    chance = [2.0 * np.sqrt(one.changed / one.of) if by_chance else 0.0 for one in (half, double)]
    better = [fewer > max(least, such) for fewer, such in zip(other, chance, strict=True)]
    return LOOK if any(better) else STANDS


def usual_of(answers: Sequence[Answer]) -> dict[str, Answer]:
    """What is wrong with the usual settings, by their class."""
    return {one.setting: one for one in answers if "." not in one.setting}


def tables(answers: Sequence[Answer], table_of: dict[str, str]) -> list[str]:
    """Lines of a page: the settings under their headings, in the order of their names.

    Args:
        answers: of the usual settings, and of half and double of each.
        table_of: how a TOML file names each class's table.
    """
    usual = usual_of(answers)

    def place(name: str) -> str:
        kind, _, key = name.partition(".")
        return f"`{table_of[kind]}.{key}` | `{name}`"

    def heading(name: str, both: Mapping[float, Answer]) -> str:
        return verdict(both[0.5], both[2.0], usual[name.partition(".")[0]])

    varied = [one for one in answers if "." in one.setting]
    return under_headings(varied, heading, place)


def number_tables(answers: Sequence[Answer], usual: Answer) -> list[str]:
    """The same of constants of modules, called by file and name, judged by answers that are independent.

    Args:
        answers: of half and double of each.
        usual: with all as they are.
    """

    def heading(_: str, both: Mapping[float, Answer]) -> str:
        return verdict(both[0.5], both[2.0], usual, by_chance=True)

    return under_headings(answers, heading, place_of_number)


def place_of_number(name: str) -> str:
    """The first two cells of a constant's row, by its file and name."""
    file, _, constant = name.partition(" ")
    return f"`{file}` | `{constant}`"


def shares(one: Answer) -> str:
    """What a cell says of one value: shares that are wrong and that are others than usual."""
    return f"× {one.factor:g}: {100 * one.wrong:.2f} %, {100 * one.changed:.2f} % otherwise"


def under_headings(
    answers: Sequence[Answer],
    heading: Callable[[str, Mapping[float, Answer]], str],
    place: Callable[[str], str],
    words: Callable[[Answer], str] = shares,
    headings: Sequence[str] = (NOTHING, STANDS, LOOK),
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
