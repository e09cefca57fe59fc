"""A diagnosis as pieces of the page; whatever comes from a file is shown as text."""

import html
from collections.abc import Mapping, Sequence

from addb_viewer.text.diagnosis_words import SPREAD
from addb_viewer.text.plain_words import in_plain_words
from addb_viewer.text.residual_words import what_is_wrong
from addb_viewer.text.sections import Section, unbroken
from addb_viewer.text.verdict_words import verdict
from addb_viewer.trial_view.html_pieces import LISTS, boxed
from addb_viewer.trial_view.palette import BLUE, GREEN, GREY, VERMILION, Rgb
from solver.diagnosis.diagnosis_report import DiagnosisReport

# A word, a sign and a colour each: nobody has to tell colours apart.
VERDICTS: Mapping[str, tuple[str, str, Rgb]] = {
    "clean": ("✓", "Clean", GREEN),
    "explained": ("!", "Explained", BLUE),
    "unexplained": ("?", "Unexplained", VERMILION),
}


def verdict_html(figures: DiagnosisReport | None, changed: Sequence[str] = ()) -> str:
    """The verdict as a banner, and what speaks for it.

    Args:
        figures: in the shape of `diagnose --json`; None where nobody has asked yet.
        changed: recordings that are no longer those that were diagnosed.
    """
    if figures is None:
        return boxed(
            "<p style='margin:.2em 0'>No diagnosis yet. <b>Diagnose</b> looks at all trials together and "
            "says what is wrong with the recordings, why, how sure that is, and what to do about it.</p>"
        )
    sign, word, color = VERDICTS.get(figures.verdict, ("?", figures.verdict, GREY))
    head = (
        f"<div style='display:flex;align-items:center;gap:.5em;font-weight:bold;font-size:14px'>"
        f"<span style='background:{color.css};color:{color.ink.css};border-radius:50%;width:1.4em;"
        f"height:1.4em;display:inline-flex;align-items:center;justify-content:center'>{sign}</span>"
        f"{html.escape(word)}</div>"
    )
    banner = (
        f"<div style='border-left:.35em solid {color.css};background:{color.faded(0.1)};padding:.45em .6em;"
        f"margin-bottom:.4em'>{head}{_lines(verdict(figures))}</div>"
    )
    wrong = what_is_wrong(figures)
    return boxed(_changed(changed) + banner + _lines(wrong) + _rows(wrong))


def section_html(section: Section, *, spread: bool = False) -> str:
    """Sentences and rows of a section, without its heading; with a word on ± where figures have one."""
    footnote = f"<p style='margin:.3em 0;opacity:.7'>{html.escape(SPREAD)}</p>" if spread else ""
    return boxed(_lines(section) + _rows(section) + footnote)


def gain_html(section: Section) -> str:
    """Before and after, one figure a line."""
    rows = "".join(
        f"<tr><td style='opacity:.65;padding-right:.8em;vertical-align:top;white-space:nowrap'>"
        f"{html.escape(label)}</td><td>{_listed(label, text)}</td></tr>"
        for label, text in section.rows
    )
    return boxed(f"<table>{rows}</table>{_lines(section)}")


def text_html(text: str, *, bold: bool = False) -> str:
    """A paragraph; nothing for an empty one."""
    if not text:
        return ""
    weight = 600 if bold else 400
    return boxed(f"<p style='margin:.2em 0;font-weight:{weight}'>{html.escape(in_plain_words(text))}</p>")


def _changed(changed: Sequence[str]) -> str:
    if not changed:
        return ""
    return (
        "<p style='margin:.2em 0 .5em'><b>⚠ Out of date.</b> Changed since: "
        f"{html.escape(', '.join(changed))}. Diagnose again.</p>"
    )


def _rows(section: Section) -> str:
    return "".join(
        f"<div style='margin:.3em 0'><div style='opacity:.7;font-size:12px'>{html.escape(label)}</div>"
        f"<div style='overflow-wrap:anywhere'>{_listed(label, text)}</div></div>"
        for label, text in section.rows
    )


def _listed(label: str, text: str) -> str:
    kept = html.escape(unbroken(in_plain_words(text)))
    return kept.replace("; ", "<br>") if label in LISTS else kept


def _lines(section: Section) -> str:
    return "".join(
        f"<p style='margin:.35em 0'>{html.escape(unbroken(in_plain_words(line)))}</p>"
        for line in section.lines
    )
