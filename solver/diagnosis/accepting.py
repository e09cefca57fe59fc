"""The extension by causes that a diagnosis has named."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Subject
from solver.common.errors import FitError
from solver.common.progress import Progress, part, silent
from solver.contact.force_review import ForceReview
from solver.diagnosis.causes.catalogue import catalogue
from solver.diagnosis.causes.effect import Candidate, Corrected, Range
from solver.diagnosis.causes.scene import Scene
from solver.diagnosis.diagnose import repaired_balance
from solver.diagnosis.extension import causes_of, extension_of
from solver.diagnosis.search.selection import select
from solver.diagnosis.search.terms import Solved
from solver.dynamics.trajectory.extension import Cause, Extension
from solver.fitting.fit import Fit
from solver.fitting.settings import Settings

STILL_COUNT = 0.2  # of a cause's frames may count, though its flag is there: borders are set by eye
FITTED = 0.8  # share of the work that is done once the markers are fitted


@dataclass(frozen=True, eq=False)
class FoundAgain:
    """Named causes, fitted together and ready for trajectory fits."""

    extension: Extension
    fit: Fit  # of the markers, slips and swaps repaired
    scenes: tuple[Scene, ...]
    solved: Solved
    undone: tuple[tuple[str, str], ...] = ()  # id and target of causes that reading the files puts right
    flagged: tuple[tuple[str, str], ...] = ()  # likewise of causes on whose frames no force counts any more

    def causes_at(self, x: Float[np.ndarray, " extra"]) -> tuple[Cause, ...]:
        """The causes with the parameters that a trajectory fit found."""
        return causes_of(self.scenes, self.solved, x)


def extension_for(
    subject: Subject,
    settings: Settings,
    causes: Mapping[tuple[str, str], Sequence[Range]],
    *,
    trials: Sequence[str] | None = None,
    reviews: Mapping[str, ForceReview] | None = None,
    progress: Progress = silent,
) -> FoundAgain:
    """Fit the causes that a diagnosis named once more, none but them, and take them into an extension.

    Args:
        subject: as it was diagnosed.
        settings: likewise.
        causes: by id and target, the frames that the diagnosis gave; causes in the markers alone have no
            place here.
        trials: names of those that were diagnosed; None for all.
        reviews: by trial, what people flagged.
        progress: told the stage and the fraction done; may raise `Cancelled`.

    Raises:
        FitError: no trial has forces, a cause is not found again, or nothing is left to accept since reading
            the files or flags put all right.
    """
    balance, _, fit = repaired_balance(
        subject,
        settings,
        trials=trials,
        reviews=reviews or {},
        progress=part(progress, 0.0, FITTED),
    )

    def named(scenes: Sequence[Scene]) -> list[Candidate]:
        return [c for c in catalogue(scenes) if c.key in causes or isinstance(c, Corrected)]

    selection = select(balance, named(balance.scenes), part(progress, FITTED, 1.0), named)
    extension = extension_of(balance.scenes, selection.solved)
    undone = causes.keys() & {c.key for c in selection.corrected}
    again = {(cause.id, cause.target) for cause in extension.causes}
    missing = causes.keys() - again - undone
    flagged = {key for key in missing if _are_left_out(causes[key], balance.scenes)}
    if missing - flagged:
        raise FitError(
            f"{subject.folder}: not found again: {_listed(missing - flagged)}. Flags or settings have "
            "changed since the diagnosis; run it again: addb-viewer diagnose"
        )
    if not extension.causes and flagged:
        raise FitError(
            f"{subject.folder}: nothing to accept: every fit leaves out the frames of {_listed(flagged)}, "
            "since they are flagged"
        )
    if not extension.causes:
        raise FitError(
            f"{subject.folder}: nothing to accept: every fit corrects what the diagnosis names when it reads "
            "the files. Correct the files, so that other programs read them right as well"
        )
    return FoundAgain(
        extension,
        fit,
        balance.scenes,
        selection.solved,
        undone=tuple(sorted(undone)),
        flagged=tuple(sorted(flagged)),
    )


def _are_left_out(ranges: Sequence[Range], scenes: Sequence[Scene]) -> bool:
    """Whether flags leave out the forces on nearly all frames on which a cause acts."""
    counts = {scene.name: scene.counts for scene in scenes}
    within = [counts[r.trial][r.start : r.end] for r in ranges if r.trial in counts]
    return bool(within) and np.concatenate(within).mean() < STILL_COUNT


def _listed(causes: Iterable[tuple[str, str]]) -> str:
    return ", ".join(f"{id_} ({target})" for id_, target in sorted(causes))
