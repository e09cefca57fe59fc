"""What stands above all tabs: who else is on the trial, what is at work, and which solve waits."""

import html
from collections.abc import Sequence

from addb_viewer.app.jobs.progress_html import in_words
from addb_viewer.app.style.html_pieces import boxed
from addb_viewer.app.subjects.shared_subject import SubjectRoom


def banner_html(room: SubjectRoom, others: Sequence[str]) -> str:
    """The lines of the banner; empty where there is nothing to say.

    Args:
        room: of the subject on the screen.
        others: names of those on the same trial.
    """
    lines, new, progress = [], room.new, room.bench.progress
    if others:
        who = html.escape(" and ".join(others))
        lines.append(f"<b>{who} {'is' if len(others) == 1 else 'are'} on this trial too.</b>")
    if new is not None:
        lines.append(
            f"<b>Solve {new.number}, for {html.escape(new.by)}, is on the screen and waits</b>: keep it or "
            "discard it, under Solve."
        )
    if progress is not None:
        share = "" if progress.fraction is None else f", {100 * progress.fraction:.0f} %"
        after = "".join(f"; then {in_words(task)}" for task in progress.waiting)
        lines.append(f"{in_words(progress.task)}{share}{after}.")
    elif room.library.fit is None:
        lines.append("No fit yet: G makes the first one, which is kept.")
    return boxed("".join(f"<div>{line}</div>" for line in lines)) if lines else ""
