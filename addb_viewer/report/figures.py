"""What a report says, as plain values: the shape of `report --json`."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.frames_kept import Kept
from addb_viewer.report.overview import Entry


def pages_written(entries: Sequence[Entry], overview: Path | None) -> dict[str, Any]:
    """Each subject's page with its chief figures; or why it has none.

    Args:
        entries: the subjects.
        overview: the page that leads to them, of several.
    """
    return {
        "pages": [_page(entry) for entry in entries],
        "overview": None if overview is None else str(overview),
    }


def _page(entry: Entry) -> dict[str, Any]:
    report = entry.report
    if report is None:
        return {"subject": entry.name, "file": None, "error": entry.error, "trials": [], "verdict": None}
    diagnosis = report.diagnosis.figures
    return {
        "subject": entry.name,
        "file": str(entry.file),
        "error": None,
        "trials": _trials(report),
        "verdict": None if diagnosis is None else diagnosis["verdict"],
    }


def _trials(report: SubjectReport) -> list[dict[str, Any]]:
    return [
        _trial(record.figures, kept)
        for record, kept in zip(report.recording.trials, report.kept, strict=True)
    ]


def _trial(figures: Mapping[str, Any], kept: Kept) -> dict[str, Any]:
    return {
        "name": figures["name"],
        "frames": kept.frames,
        "usable_frames": kept.count,
        "usable_ranges": [list(r) for r in kept.ranges],
        "left_out": [
            {"foot": cause.foot, "reason": cause.reason, "ranges": [list(r) for r in cause.ranges]}
            for cause in kept.causes
        ],
        "mask_source": figures["mask_source"],
        "hicks": dict(figures["hicks"]),
    }
