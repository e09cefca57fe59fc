"""How far a command is, as a piece of the page."""

import html
from typing import Any

import viser

from addb_viewer.app.jobs.job_queue import Task, TaskProgress
from addb_viewer.trial_view.html_pieces import boxed

TOLD_FROM, TOLD_AFTER_S = 0.02, 3.0  # share done, and [s] at work, from which the time left is worth telling


def progress_html(progress: TaskProgress) -> str:
    """What is being done, by whom, for how long, and how long it may still take."""
    said = [html.escape(progress.stage), f"{progress.seconds:.0f} s so far"]
    fraction, seconds = progress.fraction, progress.seconds
    if fraction is not None and fraction > TOLD_FROM and seconds > TOLD_AFTER_S:
        said.append(f"about {seconds * (1 - fraction) / fraction:.0f} s left")
    by = f" <span style='opacity:.75'>for {html.escape(progress.task.by)}</span>" if progress.task.by else ""
    after = "".join(f"<div>then: {task_words(task)}</div>" for task in progress.waiting)
    return boxed(" · ".join(said) + by + after)


def task_words(task: Task) -> str:
    """What is done for whom, as safe HTML."""
    return html.escape(task.words)


def show_progress(bar: Any, status: viser.GuiHtmlHandle, progress: TaskProgress) -> None:
    """Fill a bar, moving where the work does not say how far it is, and write what it does."""
    known = progress.fraction is not None
    bar.animated = not known
    bar.value = 100.0 * progress.fraction if progress.fraction is not None else 100.0
    status.content = progress_html(progress)
