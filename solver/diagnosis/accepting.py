"""The extension by causes that a diagnosis has named."""

from collections.abc import Mapping, Sequence, Set

from solver.capture.capture import Subject
from solver.contact.wrenches import MissingRange
from solver.diagnosis.diagnose import repaired_balance
from solver.diagnosis.extension import extension_of
from solver.diagnosis.selection import select
from solver.diagnosis.settings import DIAGNOSIS
from solver.dynamics.extension import Extension
from solver.effects.catalogue import catalogue
from solver.errors import FitError
from solver.progress import Progress, part, silent
from solver.settings import Settings

FITTED = 0.8  # share of the work that is done once the markers are fitted


def extension_for(
    subject: Subject,
    settings: Settings,
    causes: Set[tuple[str, str]],
    *,
    trials: Sequence[str] | None = None,
    reviews: Mapping[str, Sequence[MissingRange]] | None = None,
    progress: Progress = silent,
) -> Extension:
    """Fit the causes that a diagnosis named once more, none but them, and take them into an extension.

    Args:
        subject: as it was diagnosed.
        settings: likewise.
        causes: id and target of each; causes in the markers alone have no place here.
        trials: names of those that were diagnosed; None for all.
        reviews: by trial, what people flagged.
        progress: told the stage and the fraction done; may raise `Cancelled`.

    Raises:
        FitError: no trial has forces, or a cause is not found again.
    """
    balance, _ = repaired_balance(
        subject,
        settings,
        DIAGNOSIS,
        trials=trials,
        reviews=reviews or {},
        progress=part(progress, 0.0, FITTED),
    )
    named = [c for c in catalogue(balance.scenes) if (c.id, c.target) in causes]
    selection = select(balance, named, part(progress, FITTED, 1.0))
    extension = extension_of(balance.scenes, selection.solved)
    lost = causes - {(cause.id, cause.target) for cause in extension.causes}
    if lost:
        named_ones = ", ".join(f"{id_} ({target})" for id_, target in sorted(lost))
        raise FitError(
            f"{subject.folder}: not found again: {named_ones}. Flags or settings have changed since the "
            "diagnosis; make it anew: addb-viewer diagnose"
        )
    return extension
