"""What stands above all tabs: who else is on the trial."""

import html
from collections.abc import Sequence

from addb_viewer.app.page import boxed


def banner_html(others: Sequence[str]) -> str:
    """The lines of the banner; empty where there is nothing to say.

    Args:
        others: names of those on the same trial.
    """
    lines = []
    if others:
        who = html.escape(" and ".join(others))
        lines.append(f"<b>{who} {'is' if len(others) == 1 else 'are'} on this trial too.</b>")
    return boxed("".join(f"<div>{line}</div>" for line in lines)) if lines else ""
