"""Trains predictors on some persons and holds them against the forces of others."""

import csv
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from addb_viewer.benchmark.release_trials import BenchmarkRelease, Parts
from addb_viewer.benchmark.results import OutsideAnswers, Result, Terms
from addb_viewer.benchmark.scoring import Frames, Score, scores_of
from addb_viewer.benchmark.task import BenchmarkError, Example, Predicted, Predictor

LOG_FILE = "log.csv"


@dataclass(frozen=True)
class TimeHistory:
    """Which persons of which split are tested, on which frames."""

    split: str = "default"
    parts: tuple[str, ...] = (
        "test",
    )  # several folds are tested one after the other, each trained for itself
    frames: Frames = "scored"


class FolderLog:
    """Keeps rows of figures in `log.csv` of a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def __call__(self, **figures: float | str) -> None:
        """Append a row; the first one gives the columns their names."""
        path = self.folder / LOG_FILE
        new = not path.exists()
        with path.open("a", newline="") as file:
            rows = csv.DictWriter(file, figures)
            if new:
                rows.writeheader()
            rows.writerow(figures)


def train(
    source: BenchmarkRelease, make: Callable[[], Predictor], time_history: TimeHistory, work: Path
) -> Path:
    """Let a new predictor learn for each tested part; nobody of that part is opened.

    Args:
        source: the release.
        make: a predictor that has learnt nothing yet, for each part.
        time_history: who is tested later.
        work: folder for what it keeps; a folder for each part is made in one of the predictor's name.

    Returns:
        The predictor's folder.
    """
    for part in time_history.parts:
        predictor = make()
        _trained(source, predictor, source.parts(time_history.split, part), work / predictor.name / part)
    return work / predictor.name


def evaluate(
    source: BenchmarkRelease, make: Callable[[], Predictor], time_history: TimeHistory, work: Path
) -> Result:
    """Train where that has not been done, predict the tested persons' motion, and score it.

    Args:
        source: the release.
        make: a predictor that has learnt nothing yet, for each part: what one learns in a fold from persons
            whom another tests goes no further.
        time_history: who is tested.
        work: as for `train`.

    Raises:
        BenchmarkError: the predictor's answer cannot be used, or has seen the forces.
    """
    predictor = make()
    markers = bool(getattr(predictor, "needs_markers", False))
    spent = 0.0

    def timed(example: Example) -> Predicted:
        nonlocal spent
        began = time.perf_counter()
        predicted = predictor.predict(example.seen)
        spent += time.perf_counter() - began
        return predicted

    scores: list[Score] = []
    for k, part in enumerate(time_history.parts):
        predictor = make() if k else predictor
        parts = source.parts(time_history.split, part)
        _trained(source, predictor, parts, work / predictor.name / part)
        scores += _scores(source, parts.test, timed, time_history.frames, markers)
    notes = _notes(source, scores)
    terms = _terms(source, time_history, scores)
    return Result(predictor.name, terms, tuple(scores), round(spent, 3), markers, notes)


def evaluate_outside(source: BenchmarkRelease, answers: OutsideAnswers, time_history: TimeHistory) -> Result:
    """Score answers that were made elsewhere.

    Args:
        source: the release.
        answers: for every frame of the tested persons.
        time_history: who is tested.

    Raises:
        BenchmarkError: frames are missing, or the forces have been seen.
    """
    scores = [
        score
        for part in time_history.parts
        for score in _scores(
            source, source.parts(time_history.split, part).test, answers.of, time_history.frames, False
        )
    ]
    return Result(
        answers.name, _terms(source, time_history, scores), tuple(scores), 0.0, notes=_notes(source, scores)
    )


def _trained(source: BenchmarkRelease, predictor: Predictor, parts: Parts, folder: Path) -> None:
    shared = (parts.train | parts.dev) & parts.test
    if shared:
        raise BenchmarkError(f"{sorted(shared)[0]} would both train and be tested")
    known: frozenset[str] = getattr(predictor, "knows", frozenset())
    if known & parts.test:
        raise BenchmarkError(
            f"{sorted(known & parts.test)[0]} is tested, and {predictor.name} starts from weights that have "
            "learnt from this person; start from a training on other persons"
        )
    predictor.fit(source.trials(parts.train), source.trials(parts.dev), FolderLog(folder))


def _scores(
    source: BenchmarkRelease,
    persons: frozenset[str],
    answer: Callable[[Example], Predicted],
    frames: Frames,
    markers: bool,
) -> Iterator[Score]:
    for example in source.trials(persons, markers=markers):
        yield from scores_of(example, answer(example), frames)


def _terms(source: BenchmarkRelease, time_history: TimeHistory, scores: Sequence[Score]) -> Terms:
    if not scores:
        raise BenchmarkError(f"no frame of {', '.join(time_history.parts)} can be scored; try --frames all")
    manifest = source.release.manifest
    return Terms(
        str(manifest["name"]),
        str(manifest["version"]),
        time_history.split,
        time_history.parts,
        source.inertias,
        time_history.frames,
    )


def _notes(source: BenchmarkRelease, scores: Sequence[Score]) -> tuple[str, ...]:
    tested = {score.subject_id for score in scores}
    without = [name for name in source.without_entered_mass if name in tested]
    if source.inertias == "fitted" or not without:
        return ()
    return (f"{', '.join(without)}: no mass was entered; the fitted body is shown, which knows the forces",)
