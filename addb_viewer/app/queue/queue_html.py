"""The list of trials with their verdicts, and what there is to say at its end."""

import html
from collections import Counter
from collections.abc import Mapping, Sequence

from addb_viewer.app.jobs.fit_all import Fitting
from addb_viewer.app.queue.queue_rows import Row
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.text.amounts import counted
from addb_viewer.trial_view.html_pieces import boxed
from addb_viewer.trial_view.trial_verdict import USES
from annotations.events import Status

SIGNS = {Status.UNSEEN: "○", Status.IN_WORK: "◐", Status.FINISHED: "●", Status.SECOND_LOOK: "↺"}
RELEASE = "addb-viewer dataset build"


def rows_html(
    rows: Sequence[Row],
    here: TrialPlace,
    *,
    notes: Sequence[str] = (),
    people: Mapping[TrialPlace, Sequence[str]] | None = None,
    at_work: Mapping[str, str] | None = None,
) -> str:
    """The queue as a list.

    Args:
        rows: in order.
        here: subject and trial on the screen.
        notes: on what was left out.
        people: names of the others, by where they are.
        at_work: what is at work, by subject; safe HTML.
    """
    seen: set[str] = set()
    parts = []
    for i, row in enumerate(rows):
        there = (people or {}).get((row.subject, row.trial), ())
        told = (
            [f"{html.escape(' and '.join(there))} {'is' if len(there) == 1 else 'are'} here"] if there else []
        )
        if row.subject not in seen and row.subject in (at_work or {}):
            told.append((at_work or {})[row.subject])
        seen.add(row.subject)
        parts.append(_row_html(i, row, told, is_here=(row.subject, row.trial) == here))
    body = "".join(parts) + "".join(f"<div>⚠ {html.escape(note)}</div>" for note in notes)
    body += (
        "<p>○ unseen ◐ in work ● finished ↺ second look. <a href='/queue' target='addb-viewer-queue'>"
        "The queue as a page</a>: filters, many at once.</p>"
    )
    return f"<div data-addb-wide>{boxed(body)}</div>"


def _row_html(index: int, row: Row, told: Sequence[str], *, is_here: bool) -> str:
    marked = "background:rgba(128,128,128,.25);" if is_here else ""
    name = " · ".join(html.escape(part) for part in (row.subject, row.trial) if part not in ("", "."))
    said = f"⚠ {row.error}" if row.verdict is None else row.verdict.line.text
    below = "".join(f"<div>{line}</div>" for line in told)
    return (
        f"<button type='button' class='addb-trial' data-addb-go-to='#{index}' style='{marked}'>"
        f"<span title='{row.status}'>{SIGNS[row.status]}</span>"
        f"<b style='overflow-wrap:anywhere'>{name}</b><span>{html.escape(said)}{below}</span></button>"
    )


def end_html(what: str, rows: Sequence[Row]) -> str:
    """After the last trial: what is done, what is unusable and why, what comes next.

    Args:
        what: that nothing waits.
        rows: of all trials.
    """
    judged = [(row, row.verdict) for row in rows if row.verdict is not None]
    counts = Counter(verdict.verdict.use for _, verdict in judged)
    told = "".join(
        f"<li>{counted(counts[use], 'trial')}: {words}</li>" for use, words in USES.items() if counts[use]
    )
    marked = "".join(
        f"<li><b>{html.escape(row.trial)}</b>: {html.escape(verdict.line.why)}</li>"
        for row, verdict in judged
        if verdict.is_marked
    )
    left = f"<p>Marked unusable, and kept out of releases:</p><ul>{marked}</ul>" if marked else ""
    return boxed(
        f"<p>{html.escape(what)}</p><ul>{told}</ul>{left}<p>Next: <code>{RELEASE}</code> builds a release of "
        "the finished trials; <code>addb-viewer report</code> writes a page for others.</p>"
    )


def words_of_rows(state: Fitting) -> dict[str, str]:
    """What stands at each subject's first row, as safe HTML."""
    rows = dict.fromkeys(state.waiting, "waits to be fitted")
    rows |= {name: f"⚠ not fitted: {html.escape(why)}" for name, why in state.failures.items()}
    if state.subject:
        percent = "" if state.fraction is None else f" · {100 * state.fraction:.0f} %"
        rows[state.subject] = f"Fitting: {html.escape(state.stage or 'starting')}{percent}"
    return rows
