"""The Queue panel's pieces of the page: the table of trials, and how far the fits of all subjects are."""

import html
from collections.abc import Mapping, Sequence

from addb_viewer.app.jobs.fit_all import Fitting
from addb_viewer.app.queue.queue_rows import Row
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.trial_view.html_pieces import boxed
from annotations.events import Status

FIGURE = "text-align:right;white-space:nowrap;padding-left:.5em;"  # style of a column of figures
HEADINGS = ("of<br>bound", "left<br>out", "to<br>decide")  # residual, frames, proposals
SIGNS = {Status.UNSEEN: "○", Status.IN_WORK: "◐", Status.FINISHED: "●", Status.SECOND_LOOK: "!"}
BAR = "height:4px;border-radius:2px;background:rgba(128,128,128,.3);margin:.2em 0;overflow:hidden"
FILLED = "height:100%;background:#2a7de1"


def rows_html(
    rows: Sequence[Row],
    here: TrialPlace,
    *,
    several: bool,
    notes: Sequence[str] = (),
    people: Mapping[TrialPlace, Sequence[str]] | None = None,
    at_work: Mapping[str, str] | None = None,
) -> str:
    """The queue as a table.

    Args:
        rows: in order.
        here: subject and trial on the screen.
        several: whether the root has several subjects.
        notes: on what was left out.
        people: names of the others, by where they are.
        at_work: what is at work, by subject; safe HTML.
    """
    body = "".join(
        _row_html(i, row, here, several, _told(rows[:i], row, people or {}, at_work or {}))
        for i, row in enumerate(rows)
    )
    head = "<tr style='opacity:.75'><td></td><td>trial</td>"
    head += "".join(f"<td style='{FIGURE}'>{words}</td>" for words in HEADINGS) + "</tr>"
    told = "".join(f"<div>⚠ {html.escape(note)}</div>" for note in notes)
    return boxed(
        f"<table style='width:100%;border-collapse:collapse'>{head}{body}</table>"
        "<div style='opacity:.75;margin-top:.3em'>residual in units of its bound · "
        "○ unseen ◐ in work ● finished ! second look · * chosen by detection, not by a person</div>"
        f"{told}"
    )


def _told(
    above: Sequence[Row],
    row: Row,
    people: Mapping[TrialPlace, Sequence[str]],
    at_work: Mapping[str, str],
) -> str:
    """Below a trial's name: who is there; and what is about the whole subject, at its first row only."""
    here = people.get((row.subject, row.trial), ())
    lines = [f"{html.escape(' and '.join(here))} {'is' if len(here) == 1 else 'are'} here"] if here else []
    if not any(other.subject == row.subject for other in above):
        if row.subject in at_work:
            lines.append(at_work[row.subject])
        if row.waiting:
            lines.append(
                f"New solve of {html.escape(' and of '.join(row.waiting))} waits: keep or discard it"
            )
    return "".join(f"<div>{line}</div>" for line in lines)


def _row_html(index: int, row: Row, here: TrialPlace, several: bool, told: str) -> str:
    marked = "background:rgba(128,128,128,.25);" if (row.subject, row.trial) == here else ""
    name = f"<b>{html.escape(row.trial)}</b>" if row.trial else ""
    if several:
        name += f"<div style='opacity:.75'>{html.escape(row.subject)}</div>"
    if row.error:
        return (
            f"<tbody data-addb-go-to='#{index}' style='cursor:pointer'><tr><td>⚠</td><td colspan='4'>"
            f"{html.escape(row.subject)}: {html.escape(row.error)}</td></tr></tbody>"
        )
    # what is told has the whole width: a reason may be long
    below = f"<tr><td></td><td colspan='4' style='overflow-wrap:anywhere'>{told}</td></tr>" if told else ""
    by = f" title='{html.escape(row.by)}'" if row.by else ""
    residual = "no fit" if row.figures is None else "–" if row.residual is None else f"{row.residual:.2f}"
    bad = "font-weight:700;" if row.residual is not None and row.residual > 1 else ""
    left_out = "" if row.left_out is None else f"{100 * row.left_out:.0f} %{'*' if row.undecided else ''}"
    return (
        f"<tbody data-addb-go-to='#{index}' style='cursor:pointer;{marked}"
        "border-top:1px solid rgba(128,128,128,.3)'><tr>"
        f"<td{by} style='padding-right:.4em'>{SIGNS[row.status]}</td>"
        f"<td style='overflow-wrap:anywhere'>{name}</td>"
        f"<td style='{FIGURE}{bad}'>{residual}</td><td style='{FIGURE}'>{left_out}</td>"
        f"<td style='{FIGURE}'>{row.proposed or ''}</td></tr>{below}</tbody>"
    )


def fitting_html(state: Fitting) -> str:
    """All of it in two lines; empty where nothing was asked for."""
    if not state.total:
        return ""
    failed = f" · <b>{len(state.failures)} failed</b>, see ⚠ below" if state.failures else ""
    if not state.running:
        return boxed(f"Fitted {state.fitted} of {state.total}{failed}")
    ended = state.fitted + len(state.failures)
    said = [f"<b>Fitting {min(ended + 1, state.total)} of {state.total}</b>"]
    if state.by:
        said.append(f"for {html.escape(state.by)}")
    if state.held_up:
        said.append("waits for what people have asked for")
    elif state.seconds_left is not None:
        said.append(f"about {_in_words(state.seconds_left)} left")
    share = (ended + (state.fraction or 0.0)) / state.total
    return boxed(" · ".join(said) + failed + bar(share))


def words_of_rows(state: Fitting) -> dict[str, str]:
    """What stands at each subject's first row, as safe HTML."""
    rows = dict.fromkeys(state.waiting, "waits to be fitted")
    rows |= {name: f"⚠ not fitted: {html.escape(why)}" for name, why in state.failures.items()}
    if state.subject:
        percent = "" if state.fraction is None else f" · {100 * state.fraction:.0f} %"
        stage = html.escape(state.stage or "starting")
        rows[state.subject] = f"Fitting: {stage}{percent}{bar(state.fraction or 0.0)}"
    return rows


def bar(share: float) -> str:
    """A line that fills."""
    return f"<div style='{BAR}'><div style='{FILLED};width:{100 * share:.0f}%'></div></div>"


def _in_words(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
