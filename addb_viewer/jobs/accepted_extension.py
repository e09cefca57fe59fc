"""The causes that a person accepted as part of a subject's model, as long as its recordings are the same.

What the trajectory fit gains by the second decision is in `extension-2.json`, beside `extension-2.npz`.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from solver.capture.capture import Subject, TrialFiles
from solver.common.errors import ResultsError
from solver.common.notes import Kind, Note
from solver.common.small_files import json_content
from solver.common.typed_json import from_plain, plain
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.fit_result import Fit
from solver.fitting.provenance import extension_in, other_recordings, provenance_of
from solver.fitting.results.extension_log import Decision, accepted
from solver.fitting.results.store import write_json

if TYPE_CHECKING:
    from solver.diagnosis.diagnosis_report import AcceptedGain


def extension_for_solve(
    subject: Subject, trials: Sequence[TrialFiles], results: Path
) -> tuple[Extension | None, tuple[Note, ...]]:
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
    changed = other_recordings(decision.made_from, provenance_of(subject, trials))
    if changed:
        text = (
            f"the accepted extension ({extension.sentence}) is not used, because these have changed since: "
            f"{', '.join(changed)}"
        )
        return None, (Note(Kind.REVIEWS, text, advice="diagnose the subject anew"),)
    return extension, ()


def keep_gain(gain: "AcceptedGain", decision: Decision, results: Path) -> Path:
    """Write what an accepted extension gains beside its wrenches; all of it or nothing.

    Args:
        gain: as it is told.
        decision: that accepted it.
        results: the results folder.

    Returns:
        The file.
    """
    path = _gain_file(decision, results)
    assert path is not None
    write_json(path, plain(gain))
    return path


def kept_gain(decision: Decision, results: Path) -> "AcceptedGain | None":
    """What an accepted extension gains; None of a rejection, and where nobody looked.

    Raises:
        ResultsError: the file cannot be read.
    """
    path = _gain_file(decision, results)
    if path is None or not path.is_file():
        return None
    from solver.diagnosis.diagnosis_report import AcceptedGain  # noqa: PLC0415 (slow to load)

    try:
        return from_plain(json_content(path), AcceptedGain)
    except (ValueError, OSError) as error:
        raise ResultsError(
            f"{path}: not what an extension gains ({error}). Make it anew: addb-viewer accept"
        ) from error


def _gain_file(decision: Decision, results: Path) -> Path | None:
    return None if decision.wrenches is None else results / Path(decision.wrenches).with_suffix(".json")


def extension_of(fit: Fit, results: Path) -> Extension | None:
    """What the fit took as acting beside the recorded forces.

    Args:
        fit: kept in the results folder.
        results: that folder.

    Raises:
        ResultsError: another extension is accepted by now, or it cannot be read.
    """
    wanted = extension_in(fit.provenance)
    if wanted is None:
        return None
    kept = accepted(results)
    if kept is None or kept[1].fingerprint != wanted:
        raise ResultsError(f"{results}: the fit was made with causes that are no longer accepted; fit anew")
    return kept[1]
