"""The last diagnosis of a subject, kept beside its fit: what it says, and what it was made of."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from solver.capture.atomic import made_folder
from solver.common.errors import ResultsError
from solver.common.small_files import json_content
from solver.diagnosis.diagnosis_report import DiagnosisReport, read_report
from solver.fitting.results.store import write_json

FILE = "diagnosis.json"
MADE_FROM = "made_from"  # provenance and settings; the rest is what `diagnose --json` writes


def keep(figures: DiagnosisReport, made_from: Mapping[str, Any], results: Path) -> Path:
    """Write a diagnosis in place of the last one; all of it or nothing.

    Args:
        figures: of the diagnosis.
        made_from: `provenance` and `settings`, as a fit keeps them.
        results: the results folder, made where it's missing.

    Returns:
        The file.
    """
    write_json(made_folder(results) / FILE, {**figures.as_json(), MADE_FROM: dict(made_from)})
    return results / FILE


def kept(results: Path) -> tuple[DiagnosisReport, dict[str, Any]] | None:
    """The last diagnosis and what it was made of; None where nobody has asked for one.

    Raises:
        ResultsError: the file cannot be read, or another version wrote it.
    """
    path = results / FILE
    if not path.is_file():
        return None
    try:
        content = json_content(path)
        made_from = content.pop(MADE_FROM)
        return read_report(content), made_from
    except (ValueError, KeyError, AttributeError, TypeError, OSError) as error:
        raise ResultsError(
            f"{path}: not a diagnosis ({error}). Make it anew: addb-viewer diagnose"
        ) from error
