"""A diagnosis as a page for people: sections of plain sentences, for the terminal, the app and the report."""

import textwrap
from dataclasses import replace

from addb_viewer.text.cause_words import TO_BE_SURE, TO_FLAG, cause, what_was_decided
from addb_viewer.text.detectable_words import what_would_be_found
from addb_viewer.text.diagnosis_vocabulary import about, title
from addb_viewer.text.direct_check_words import what_the_files_say
from addb_viewer.text.holding_up_words import what_it_gains
from addb_viewer.text.remainder_words import what_next, what_remains
from addb_viewer.text.residual_words import looked_for, what_is_wrong
from addb_viewer.text.sections import Section
from addb_viewer.text.verdict_words import verdict
from solver.common.notes import Kind
from solver.diagnosis.diagnosis_report import DiagnosisReport

ON_A_SCREEN = ("how large", "when", "what to do", TO_BE_SURE)  # of a cause
MOST_CAUSES = 4  # on a screen of 40 lines
SHORT = 240  # [characters] of a text there: three lines
NOTES = "Notes"
BEFORE_THE_CAUSES = "From reading and fitting the files, before causes were looked for:"
SPREAD = "±: in 19 of 20 cases the true value lies within."


def page(figures: DiagnosisReport) -> list[Section]:
    """The whole answer, the verdict first."""
    causes = [cause(figures, k) for k in range(len(figures.effects))]
    sections = [
        verdict(figures),
        what_was_decided(figures),
        what_is_wrong(figures),
        what_the_files_say(figures),
        what_would_be_found(figures),
        *causes,
        what_it_gains(figures),
        what_remains(figures),
        what_next(figures),
        how_to_read(figures),
    ]
    return [s for s in (*sections, notes(figures)) if s.lines or s.rows]


def screen(figures: DiagnosisReport) -> list[Section]:
    """The answer that fits a screen: the verdict, each cause with its size and what to do, what remains."""
    each = [cause(figures, k) for k in range(len(figures.effects))]
    causes = [
        replace(one, rows=tuple((label, _short(text)) for label, text in one.rows if label in ON_A_SCREEN))
        for one in each[:MOST_CAUSES]
    ]
    if len(each) > MOST_CAUSES:
        others = "; ".join(title(effect) for effect in figures.effects[MOST_CAUSES:])
        causes.append(Section(f"{len(each) - MOST_CAUSES} more causes", (_short(others),)))
    remains = what_remains(figures)
    unseen = [] if each else [what_would_be_found(figures)]
    after = what_was_decided(figures)
    shorter = replace(remains, lines=tuple(map(_short, remains.lines)))
    steps = Section("Besides", tuple(n for n in figures.notes if n.kind is Kind.DETECTED))
    sections = [verdict(figures), after, *unseen, *causes, steps, shorter]
    return [s for s in sections if s.lines or s.rows]


def _short(text: str) -> str:
    """Three lines at most; a command to flag frames is whole or not there."""
    said, *commands = text.split(TO_FLAG)
    if not commands:
        return textwrap.shorten(said, SHORT, placeholder=" …")
    more = f" … and {len(commands) - 1} more" if len(commands) > 1 else ""
    return f"{textwrap.shorten(said, SHORT, placeholder=' …')}{TO_FLAG}{commands[0]}{more}"


def notes(figures: DiagnosisReport) -> Section:
    """What reading and fitting noted; empty where they noted nothing."""
    noted = figures.notes
    if not (noted and figures.effects):
        return Section(NOTES, noted)
    said = (note.without_advice if note.kind is Kind.ENTERED_MASS else note for note in noted)
    return Section(NOTES, (BEFORE_THE_CAUSES, *said))


def how_to_read(figures: DiagnosisReport) -> Section:
    """What ± and "sure" mean on this page."""
    effects = figures.effects
    lines = []
    if any(effect.parameters for effect in effects):
        lines.append(f"{SPREAD} It holds if the cause is the right one.")
    if effects:
        lines.append(
            "Certainly, very likely or probably wrong compares everything that was found with nothing being "
            "wrong. How sure a name is compares the cause with all others that were tried in its place, with "
            "no cause, and with unknown causes."
        )
    if any(about(effect).at_certain_frames for effect in effects):
        lines.append("Frames are counted from 0; `flag` takes the first one and the one after the last.")
    if figures.verdict != "clean":
        lines.append(f"Tried, each alone and together with the others: {looked_for()}.")
    return Section("How to read this", tuple(lines))
