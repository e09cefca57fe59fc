"""How far the fits of all subjects are, as pieces of the page."""

import html

from addb_viewer.app.jobs.fit_all import Fitting
from addb_viewer.app.style.html_pieces import boxed

BAR = "height:4px;border-radius:2px;background:rgba(128,128,128,.3);margin:.2em 0;overflow:hidden"
FILLED = "height:100%;background:#2a7de1"


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
