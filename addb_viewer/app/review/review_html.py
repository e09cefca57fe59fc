"""The Review panel's pieces of the page; whatever comes from a file or a person is shown as text."""

import html
from collections.abc import Mapping, Sequence
from typing import Any

from addb_viewer.text.coordinate_words import torque_in_words
from addb_viewer.text.evidence_words import evidence_words
from addb_viewer.trial_view.disagreements import conflict_words
from addb_viewer.trial_view.html_pieces import boxed, clickable, range_words, swatch
from addb_viewer.trial_view.palette import Rgb, reason_color
from addb_viewer.trial_view.proposals import Pending, State
from annotations.events import Edit
from annotations.foot_names import foot_words
from annotations.reasons import REASON_KEYS, key_of, reason_words
from annotations.suggested_activity import SuggestedActivity
from annotations.trial_review import FlaggedRange, TrialReview
from annotations.wording import said_by, sure_words

LAST = 8  # edits in the history
NO_CHANGE_NM = 0.05  # shown as 0.0

_MARKED = "background:rgba(128,128,128,.25);"
_SIGNS = {State.OPEN: "?", State.ACCEPTED: "✓", State.REJECTED: "✗"}


def reasons_html() -> str:
    """Which key means what."""
    return boxed(
        "<div style='display:grid;grid-template-columns:1fr 1fr;gap:0 .6em'>"
        + "".join(
            f"<div>{swatch(reason_color(key.reason), key.key)} {html.escape(key.words)}</div>"
            for key in REASON_KEYS
        )
        + f"<div>{swatch(Rgb(255, 255, 255), '0')} the force counts</div></div>"
    )


def proposals_html(proposals: Sequence[Pending], current: Pending | None, has_fit: bool = True) -> str:
    """What detection proposes; a click goes there."""
    if not proposals and not has_fit:
        return boxed("Detection has not run on this trial yet: it needs a fit.")
    if not proposals:
        return boxed("Detection proposes nothing in this trial.")
    rows = []
    for pending in proposals:
        p = pending.proposal
        marked = _MARKED if pending is current else ""
        weight = "" if pending.state is State.OPEN else "opacity:.6;"
        details = html.escape(f"{reason_words(p.reason)}. {evidence_words(p.evidence)}")
        rows.append(
            clickable(
                range_words(p.start, p.end),
                f"<div style='{marked}{weight}padding:.1em .3em'>{_SIGNS[pending.state]} "
                f"<b>{p.start}–{p.end - 1}</b> {html.escape(foot_words(p.foot))} · "
                f"{swatch(reason_color(p.reason), _key(p.reason))} · {sure_words(p.confidence)}"
                + (f"<div style='opacity:.8'>{details}</div>" if pending is current else "")
                + "</div>",
            )
        )
    return boxed("".join(rows))


def suggested_html(suggested: Sequence[SuggestedActivity], current: SuggestedActivity | None) -> str:
    """Activities that wait for a person; a click selects their frames.

    Args:
        suggested: in order of time.
        current: the one that the buttons act on.
    """
    rows = [
        clickable(
            range_words(s.start, s.end),
            f"<div style='{_MARKED if s == current else ''}padding:.1em .3em'>? <b>{s.start}–{s.end - 1}</b> "
            f"{html.escape(s.label)} · {sure_words(s.confidence)}</div>",
        )
        for s in suggested
    ]
    return boxed("".join(rows) or "No suggestion waits for you.")


def ranges_html(review: TrialReview) -> str:
    """What does not count, by whom; and where reviewers disagree."""
    rows = [
        clickable(
            range_words(flag.start, flag.end),
            f"<div style='padding:.1em .3em'>{swatch(reason_color(flag.reason), _key(flag.reason))} "
            f"<b>{flag.start}–{flag.end - 1}</b> {html.escape(foot_words(flag.foot))} · "
            f"{html.escape(reason_words(flag.reason))} · {html.escape(flag.author)}"
            f"{f' ({html.escape(str(flag.source))})' if _says_more(flag) else ''}"
            f"{f'<br><i>{html.escape(flag.note)}</i>' if flag.note else ''}</div>",
        )
        for flag in review.flags
    ]
    rows += [
        clickable(
            range_words(a.start, a.end),
            f"<div style='padding:.1em .3em'><b>{a.start}–{a.end - 1}</b> {html.escape(a.label)} · "
            f"{html.escape(a.author)}</div>",
        )
        for a in review.activities
    ]
    rows += [f"⚠ {html.escape(str(row))}." for row in review.unreadable]
    if not review.decided and not rows:
        rows.append("None yet.")
    conflicts = "".join(
        f"<div style='margin-top:.3em'>⚠ {html.escape(conflict_words(conflict))}</div>"
        for conflict in review.conflicts
    )
    if not (rows or conflicts):
        rows.append("Every force counts.")
    return boxed("".join(rows) + conflicts)


def _says_more(flag: FlaggedRange) -> bool:
    """Whether where a flag comes from says more than its author does."""
    return str(flag.source) not in ("person", flag.author)


def history_html(edits: Sequence[Edit]) -> str:
    """The last edits, newest first."""
    rows = "".join(
        f"<div style='margin:.15em 0'>{edit.made_at.astimezone():%H:%M:%S} "
        f"<b>{html.escape(edit.author)}</b>: {html.escape(said_by(edit.event))}</div>"
        for edit in list(reversed(edits))[:LAST]
    )
    return boxed(rows or "No edits yet.")


def what_if_html(told: Mapping[str, Any], words: str) -> str:
    """Both sides of a question to the solver.

    Args:
        told: `present` and `instead` in figures, `torque`, and `seconds`.
        words: what was asked.
    """
    rows = "".join(
        f"<tr><td style='padding-right:.8em;opacity:.75'>{label}</td>"
        f"<td>{_figure(told['present'][name], factor, digits)} → "
        f"<b>{_figure(told['instead'][name], factor, digits)}</b> {unit}</td></tr>"
        for label, name, factor, digits, unit in (
            ("residual force", "force_N", 1.0, 1, "N"),
            ("residual moment", "moment_Nm", 1.0, 1, "N·m"),
            ("marker error", "marker_rms_m", 100.0, 2, "cm"),
            ("frames counted", "frames", 1.0, 0, ""),
        )
    )
    changed = f"{html.escape(_torque(told['torque']))}<br>"
    return boxed(
        f"<b>{html.escape(words)}</b><table>{rows}</table>{changed}"
        f"<span style='opacity:.75'>As G would solve it, in {told['seconds']:.1f} s.</span>"
    )


def what_if_words(told: Mapping[str, Any]) -> str:
    """The same in a line."""
    return "residual " + ", ".join(
        f"{_figure(told['present'][name], 1.0, 1)} → {_figure(told['instead'][name], 1.0, 1)} {unit}"
        for name, unit in (("force_N", "N"), ("moment_Nm", "N·m"))
    )


def _torque(told: Mapping[str, Any] | None) -> str:
    if told is None or told["Nm"] < NO_CHANGE_NM:
        return "no torque changes on frames that count in both"
    name = torque_in_words(told["coordinate"])
    return f"torques change by up to {told['Nm']:.1f} N·m: {name}, frame {told['frame']}"


def _figure(value: float | None, factor: float, digits: int) -> str:
    return "–" if value is None else f"{factor * value:.{digits}f}"


def _key(reason: str) -> str:
    return key_of(reason) or "·"
