"""The causes that a person accepted as part of a subject's model, as long as its recordings are the same."""

from collections.abc import Sequence
from pathlib import Path

from solver.capture.capture import Subject, TrialFiles
from solver.dynamics.extension import Extension
from solver.provenance import other_recordings, provenance_of
from solver.results.extension_log import accepted


def extension_for_solve(
    subject: Subject, trials: Sequence[TrialFiles], results: Path
) -> tuple[Extension | None, tuple[str, ...]]:
    """What a solve takes as acting beside the recorded forces, and what people should know about it.

    Args:
        subject: whose.
        trials: those to be solved.
        results: the results folder, where decisions are kept.

    Raises:
        ResultsError: the log or the wrenches cannot be read.
    """
    kept = accepted(results)
    if kept is None:
        return None, ()
    decision, extension = kept
    changed = other_recordings(decision.made_of, provenance_of(subject, trials))
    if changed:
        note = (
            f"the accepted extension ({extension.sentence}) is not used, because these have changed since: "
            f"{', '.join(changed)}; diagnose the subject anew"
        )
        return None, (note,)
    return extension, ()
