"""What is wrong with a subject's recordings: a verdict and named causes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from addb_viewer.text.diagnosis_vocabulary import amounts, sentence, title
from addb_viewer.text.diagnosis_words import page, screen
from addb_viewer.text.sections import as_text
from solver.common.notes import Note
from solver.diagnosis.diagnosis_report import Cause as Found
from solver.diagnosis.diagnosis_report import DiagnosisReport

NOT_KNOWN = float("nan")


class Estimate(NamedTuple):
    """A figure of a cause and its standard deviation; the unit ends the parameter's name: `offset_s`."""

    value: float
    std: float  # NaN where the recording says nothing about it


@dataclass(frozen=True)
class Cause:
    """Something that is wrong, or acts unseen: a plate's clock, a missed step, a load that is carried."""

    id: str  # of the catalogue (docs/reference/causes.md lists them)
    target: str  # what it is about: a plate, a body, a marker, "all"
    title: str  # in a few words
    sentence: str  # what it means
    remedy: str  # what to do in the laboratory
    confidence: float  # 0 to 1 that this is the cause, among those of the catalogue and none of them
    parameters: Mapping[str, Estimate]
    frames: tuple[tuple[str, int, int], ...]  # trial, first frame, and the one after the last

    @property
    def key(self) -> tuple[str, str]:
        """Id and target, which name a cause of a diagnosis."""
        return self.id, self.target


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """What is wrong with the recordings. `print(diagnosis)` is the screen of `addb-viewer diagnose`."""

    report: DiagnosisReport
    file: Path  # that keeps it
    new: bool = True  # False: nothing had changed, so the kept answer stands

    @property
    def figures(self) -> Mapping[str, Any]:
        """Everything as plain values, in the shape of `addb-viewer diagnose --json`."""
        return self.report.as_json()

    @property
    def verdict(self) -> str:
        """Either "clean", "explained" (causes are named) or "unexplained" (something is left, or all)."""
        return self.report.verdict

    @property
    def trials(self) -> tuple[str, ...]:
        """Those that were looked at, together."""
        return self.report.trials

    @property
    def notes(self) -> tuple[Note, ...]:
        """What was assumed, converted or ignored."""
        return self.report.notes

    @cached_property
    def causes(self) -> tuple[Cause, ...]:
        """The named causes, as the answer orders them."""
        return tuple(map(_cause, self.report.effects))

    def __iter__(self) -> Iterator[Cause]:
        """The causes."""
        return iter(self.causes)

    def __len__(self) -> int:
        """Number of causes."""
        return len(self.causes)

    def __repr__(self) -> str:
        """Verdict and causes in a line."""
        named = "; ".join(cause.title for cause in self.causes) or "no cause"
        return f"<Diagnosis of {', '.join(self.trials)}: {self.verdict}; {named}>"

    def __str__(self) -> str:
        """The answer that fits a screen."""
        return "\n".join(as_text(screen(self.report)))

    def in_full(self) -> str:
        """The whole answer: direct checks, certainty, what else it could be."""
        return "\n".join(as_text(page(self.report)))


def _cause(effect: Found) -> Cause:
    return Cause(
        id=effect.id,
        target=effect.target,
        title=": ".join([title(effect), *amounts(effect)[:1]]),
        sentence=sentence(effect),
        remedy=effect.remedy,
        confidence=effect.confidence,
        parameters={
            name: Estimate(_number(figure.value), _number(figure.std))
            for name, figure in effect.parameters.items()
        },
        frames=effect.frames,
    )


def _number(value: float | None) -> float:
    return NOT_KNOWN if value is None else value
