"""The Solve panel's pieces of the page; whatever comes from a file or a person is shown as text."""

import html
from collections.abc import Mapping, Sequence
from typing import Any

from addb_viewer.app.solve.comparison import Comparison
from addb_viewer.jobs.stored_solves import DISCARDED, KEPT, NEW, REPLACED, Solve
from addb_viewer.text.coordinate_words import torque_in_words
from addb_viewer.trial_view.html_pieces import boxed, clickable, table
from solver.fitting.settings import by_name

TEN = 10.0  # from which on a number has its two digits before the point
_STATES = {
    NEW: "new: keep it or discard it",
    KEPT: "the subject's fit",
    DISCARDED: "discarded",
    REPLACED: "kept before",
}


def comparison_html(found: Comparison, before: str) -> str:
    """What changed in the trial on the screen.

    Args:
        found: of the two solves.
        before: what the other solve is called.
    """
    edited = ", ".join(f"{a}–{b - 1}" for a, b in found.edited) or "none"
    figures = table(
        [(label, unbroken(was), "→" if was != now else "=", unbroken(now)) for label, was, now in found.rows],
        head=("RMS", before, "", "now"),
    )
    torques = "".join(
        clickable(
            str(change.frame),
            f"<div style='padding:.05em .3em'>{html.escape(torque_in_words(change.name))}: "
            f"<b>{_two_digits(change.rms)} {change.unit}</b> RMS, "
            f"at most {_two_digits(change.largest, '+')} {change.unit} at frame {change.frame}</div>",
        )
        for change in found.torques
    )
    where = "near the edit" if found.edited else "over the trial"
    return boxed(
        f"{figures}<div style='margin-top:.4em'>Frames whose forces count differently: {edited}</div>"
        + (f"<div style='margin-top:.4em'><b>Joint torques that changed most {where}</b></div>{torques}")
        * bool(torques)
    )


def solve_words(solve: Solve) -> str:
    """A solve in a few words, as lists have it."""
    return f"{solve.number} · {solve.when.astimezone():%d %b %H:%M} · {solve.by}"


def verdict_html(new: Solve, behind: Sequence[Solve]) -> str:
    """What is to be decided.

    Args:
        new: on the screen.
        behind: those that wait for it.
    """
    after = "".join(f"<div>After it: {html.escape(solve_words(solve))}</div>" for solve in behind)
    return boxed(
        f"<b>A new solve is on the screen.</b> {html.escape(new.by)} asked for it. Keep it or discard it; "
        f"M compares it with the one before.{after}"
    )


def history_html(made: Sequence[Solve], trial: str) -> str:
    """The solves on the disk, newest first, with the figures of the trial on the screen."""
    if not made:
        return boxed("No solves of this app yet; the fit on the screen was made on the command line, if any.")
    rows = []
    for solve in reversed(made):
        figures = solve.figures.trial(trial)
        linear, angular = (figures.linear_residual, figures.angular_residual) if figures else (None, None)
        took = "" if solve.seconds is None else f" · {solve.seconds:.0f} s"
        rows.append(
            f"<div style='margin:.25em 0'><b>{html.escape(solve_words(solve))}</b>{took}"
            f"<div style='opacity:.8'>{_STATES[solve.state]}{_decided(solve)} · "
            f"{_shown(linear and linear.rms_N)} N · {_shown(angular and angular.rms_Nm)} N·m</div></div>"
        )
    return boxed("".join(rows))


def _decided(solve: Solve) -> str:
    """By whom, where it was not the one who asked for the solve."""
    if solve.state == NEW or solve.decided_by in (None, solve.by):
        return ""
    return html.escape(f" (decided by {solve.decided_by})")


def settings_html(settings: Mapping[str, Any], standard: Mapping[str, Any]) -> str:
    """Which settings the fit on the screen was made with, as far as they are not the usual ones."""
    usual = by_name(standard)
    changed = [
        f"{name} = {value}"
        for name, value in by_name(settings).items()
        if name in usual and value != usual[name]
    ]
    if not changed:
        return boxed("Usual settings. A settings.toml in the subject's folder changes them.")
    return boxed("<b>Settings of its own</b><br>" + "<br>".join(html.escape(line) for line in changed))


def unbroken(text: str) -> str:
    """A number and its unit stay together."""
    return text.replace(" ", "\u00a0")


def _two_digits(value: float, sign: str = "") -> str:
    """All digits of large numbers, two of small ones."""
    text = f"{value:{sign}.0f}" if abs(value) >= TEN else f"{value:{sign}.2g}"
    return text.replace("-", "−")


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
