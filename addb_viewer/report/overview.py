"""All subjects of a folder on one page: a table that can be sorted, with a link to each report."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from urllib.parse import quote

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.frames_kept import Kept, decided_by, in_all
from addb_viewer.report.key_findings import frames_sentence
from addb_viewer.report.markup import Safe, element, joined
from addb_viewer.report.report_page import page_html
from addb_viewer.text.judged_figures import SOURCE, Judged, judged_figures
from addb_viewer.trial_view.recorded_subject import TrialRecord
from addb_viewer.trial_view.trial_verdict import TrialVerdict
from solver.capture.atomic import write_whole

COLUMNS = (
    "Subject",
    "Trial",
    "Frames",
    "Usable",
    "Decided by",
    "Residual force",
    "Residual moment",
    "Marker RMS",
    "Largest marker error",
    "Verdict",
)
DECIDED_SHORT = {"review": "review", "review.json": "review.json", "proposals": "detection", "none": "nobody"}


@dataclass(frozen=True)
class Entry:
    """One subject: its report and where that lies, or why there is none."""

    name: str
    file: Path | None
    report: SubjectReport | None
    error: str


def write_overview(name: str, entries: Sequence[Entry], notes: Sequence[str], file: Path) -> Path:
    """Write the page in place of the one that was there; all of it or nothing.

    Args:
        name: of the folder.
        entries: its subjects.
        notes: folders that were left out, and why.
        file: its folder must exist; reports are linked from there.

    Returns:
        The file.

    Raises:
        CaptureError: the folder cannot be written to.
    """
    write_whole(file, overview_page(name, entries, notes, file))
    return file


def overview_page(name: str, entries: Sequence[Entry], notes: Sequence[str], file: Path) -> str:
    """The page's HTML; the arguments are those of `write_overview`."""
    kept = tuple(k for entry in entries if entry.report for k in entry.report.kept)
    rows = [row for entry in entries for row in _rows(entry, file)]
    done = sum(entry.report is not None for entry in entries)
    heads = joined(
        element("th", element("button", column, type="button"), scope="col", aria_sort="none")
        for column in COLUMNS
    )
    table = element(
        "div",
        element("table", element("thead", element("tr", heads)), element("tbody", *rows), class_="sortable"),
        class_="scroll",
    )
    said = f"{done} of {len(entries)} subjects have a report, with {len(kept)} trials. "
    said += f"{frames_sentence(kept)}." if in_all(kept)[1] else ""
    pieces = [
        element("h1", name),
        element("p", f"Overview of {datetime.now().astimezone():%Y-%m-%d %H:%M}", class_="made"),
        element("p", said),
        element(
            "p", f"✓ within, ✗ beyond the bounds of {SOURCE}. A column's name sorts by it.", class_="fine"
        ),
        table,
    ]
    if notes:
        pieces += [element("h2", "Left out"), element("ul", *(element("li", note) for note in notes))]
    body = element("main", *pieces, class_="overview")
    return page_html(f"{name} — addb-viewer overview", body, ("sort.js",))


def _rows(entry: Entry, file: Path) -> list[Safe]:
    if entry.report is None or entry.file is None:
        why = element("td", element("span", f"no report: {entry.error}", class_="bad refused"), colspan="9")
        return [element("tr", element("th", entry.name, scope="row"), why)]
    address = quote(Path(os.path.relpath(entry.file, file.parent)).as_posix())
    return [
        _row(entry, address, record, kept, verdict)
        for record, kept, verdict in zip(
            entry.report.recording.trials, entry.report.kept, entry.report.verdicts, strict=True
        )
    ]


def _row(entry: Entry, address: str, record: TrialRecord, kept: Kept, verdict: TrialVerdict) -> Safe:
    source = record.figures.mask_source
    short = ", ".join(DECIDED_SHORT.get(one, one) for one in source.split(" + "))
    share = kept.count / max(kept.frames, 1)
    usable = joined((f"{kept.count} ", element("small", f"{100 * share:.0f} %")))
    return element(
        "tr",
        element("th", element("a", entry.name, href=address), scope="row"),
        element("td", record.replay.name),
        _sorted(str(kept.frames), kept.frames),
        _sorted(usable, share),
        element("td", short, title=decided_by(source, kept)),
        *(_judged(judged) for judged in judged_figures(record.figures)),
        element("td", f"{verdict.line.sign} {verdict.line.use} · {verdict.line.why}"),
    )


def _judged(judged: Judged) -> Safe:
    """Sorted by the share of its bound; what was not computed comes last."""
    if judged.share is None:
        return _sorted("–", float("inf"))
    sign, word, tone = ("✓", "within", "good") if judged.within else ("✗", "beyond", "bad")
    mark = element("span", sign, class_=f"mark {tone}", role="img", aria_label=f"{word} its bound")
    return _sorted(joined((judged.value, Safe(" "), mark)), judged.share)


def _sorted(content: str, value: float) -> Safe:
    return element("td", content, data_value=f"{value:.6g}")
