"""The Record panel's pieces of the page; whatever comes from a file is shown as text."""

import html
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from addb_viewer.app.style.html_pieces import boxed

OPENED_WITH = {
    ".html": "any browser, also without a network",
    ".rrd": "rerun {}",
    ".mcap": "Foxglove, or any reader of MCAP",
}
MEGABYTE = 1e6
BREAKS = "overflow-wrap:anywhere"


def written_html(files: Sequence[Path], refused: Sequence[Path] = ()) -> str:
    """The files on the disk, newest first: where, when, how large, and what opens them.

    Args:
        files: of the folder, newest first.
        refused: links in it that lead elsewhere.
    """
    links = "".join(
        boxed(f"<div style='{BREAKS}'>{html.escape(link.name)} leads out of the folder: not sent.</div>")
        for link in refused
    )
    if not files:
        return boxed("No files yet.") + links
    rows = []
    for file in files:
        about = file.stat()
        when = datetime.fromtimestamp(about.st_mtime).astimezone()
        opened = OPENED_WITH.get(file.suffix, "").format(html.escape(f'"{file.name}"'))
        rows.append(
            f"<div style='margin:.35em 0;{BREAKS}'><b>{html.escape(file.name)}</b>"
            f"<div>{when:%d %b %H:%M} · {about.st_size / MEGABYTE:.1f} MB · {opened}</div></div>"
        )
    place = html.escape(str(files[0].parent))
    return boxed(f"<div style='{BREAKS}'>In {place}:</div>{''.join(rows)}") + links


def log_html(file: Path | None, ended: Path | None) -> str:
    """Where the session is written down, and what to do with the file.

    Args:
        file: that grows now; None: nothing is written.
        ended: the last one of this subject that was closed, if any.
    """
    if file is not None:
        size = f" ({file.stat().st_size / MEGABYTE:.1f} MB)" if file.exists() else ""
        return boxed(
            f"<div style='{BREAKS}'><b>Writing</b> {html.escape(str(file))}{size}</div>"
            "<div style='margin-top:.4em'>After a kill, <b>addb-viewer recover FILE</b> makes a whole file "
            "of it.</div>"
        )
    what = "Trials that are opened, fits, edits, diagnoses and the solver's progress, as they happen: MCAP."
    last = "" if ended is None else f"<div style='{BREAKS}'>The last one: {html.escape(str(ended))}</div>"
    return boxed(f"<div>{what}</div>{last}")
