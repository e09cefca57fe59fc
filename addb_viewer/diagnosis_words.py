"""A diagnosis as a page for people: sections of plain sentences, for the terminal, the app and the report.

Takes the plain values of `diagnose --json`, so that a kept diagnosis reads like a new one.
"""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from addb_viewer.detectable_words import what_would_be_found
from addb_viewer.diagnosis_vocabulary import (
    CONFIDENT,
    about,
    amounts,
    certainty,
    leads_of,
    listed,
    names_of,
    percent,
    ranges_of,
    rivals_of,
    seconds_of,
    sentence,
    share,
    target_in_words,
    title,
)
from addb_viewer.gain_words import (
    changes_in_words,
    is_certain,
    is_lead,
)
from addb_viewer.holding_up_words import what_it_gains
from addb_viewer.remainder_words import explains_most, what_next, what_remains
from addb_viewer.residual_words import (
    is_whole,
    looked_for,
    what_is_wrong,
    without_advice,
)
from addb_viewer.sections import Section
from addb_viewer.use_words import trials_in_question, use
from addb_viewer.witness_words import what_the_files_say
from solver.effects.about import AtFault, Mend

ON_A_SCREEN = ("how large", "when", "what to do")  # of a cause
MOST_CAUSES = 4  # on a screen of 40 lines
SHORT = 240  # [characters] of a text there: three lines
LEAST_ELSE = 0.05  # of the certainty, for causes that are not listed
LIKELY_NATS = 20.0  # sound recordings hardly reach 8
ENDED_EARLY = (
    "The search ended before everything was tried: it had the evaluations that the settings allow "
    "(`most_evaluations` in the table [diagnosis]). What is named held up so far; more may be wrong. Look at "
    "fewer trials at a time (`--trial`), or allow more evaluations."
)
AT_FAULT = {
    AtFault.RECORDING: "the recording",
    AtFault.MODEL: "the model of the body, which leaves this out or has it wrong",
    AtFault.MOVEMENT: "a force that no plate measures, as of a step beside the plates; the files are right",
}
NOTES = "Notes"
BEFORE_THE_CAUSES = "From reading and fitting the files, before causes were looked for:"
TO_FLAG = " To flag: "  # before each command that somebody may copy
SPREAD = "±: in 19 of 20 cases the true value lies within."

Figures = Mapping[str, Any]


def page(figures: Figures) -> list[Section]:
    """The whole answer, the verdict first.

    Args:
        figures: in the shape of `diagnose --json`.
    """
    causes = [cause(figures, k) for k in range(len(figures["effects"]))]
    sections = [
        verdict(figures),
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


def screen(figures: Figures) -> list[Section]:
    """The answer that fits a screen: the verdict, each cause with its size and what to do, what remains.

    Args:
        figures: in the shape of `diagnose --json`.
    """
    each = [cause(figures, k) for k in range(len(figures["effects"]))]
    causes = [
        replace(one, rows=tuple((label, _short(text)) for label, text in one.rows if label in ON_A_SCREEN))
        for one in each[:MOST_CAUSES]
    ]
    if len(each) > MOST_CAUSES:
        others = "; ".join(title(effect) for effect in figures["effects"][MOST_CAUSES:])
        causes.append(Section(f"{len(each) - MOST_CAUSES} more causes", (_short(others),)))
    remains = what_remains(figures)
    unseen = [] if each else [what_would_be_found(figures)]
    sections = [verdict(figures), *unseen, *causes, replace(remains, lines=tuple(map(_short, remains.lines)))]
    return [s for s in sections if s.lines or s.rows]


def _short(text: str) -> str:
    """Three lines at most; a command to flag frames is whole or not there."""
    said, *commands = text.split(TO_FLAG)
    if not commands:
        return textwrap.shorten(said, SHORT, placeholder=" …")
    more = f" … and {len(commands) - 1} more" if len(commands) > 1 else ""
    return f"{textwrap.shorten(said, SHORT, placeholder=' …')}{TO_FLAG}{commands[0]}{more}"


def notes(figures: Figures) -> Section:
    """What reading and fitting noted; empty where they noted nothing."""
    noted = tuple(figures.get("notes", ()))
    if not (noted and figures["effects"]):
        return Section(NOTES, noted)
    return Section(NOTES, (BEFORE_THE_CAUSES, *map(without_advice, noted)))


def verdict(figures: Figures) -> Section:
    """Sound, wrong and why, or wrong and nobody knows why; and whether the names are more than a lead."""
    effects, leads = names_of(figures), leads_of(figures)
    text = _judged(figures, _numbered(figures, effects))
    if leads:
        also = "Besides, a" if effects else "A"
        also += " lead" if len(leads) == 1 else " few leads"
        text += f" {also}, likelier wrong than right: {_numbered(figures, leads)}."
    text += _how_likely(figures)
    whose = [_at_fault(figures)] if effects else []
    early = [ENDED_EARLY] if figures.get("ended_early") else []
    doubt = [_only_a_lead(figures)] if is_lead(figures) else []
    return Section("Verdict", (text, *whose, *early, *doubt, use(figures)))


def headline(figures: Figures) -> str:
    """The verdict in a sentence, for where the causes stand below it.

    Args:
        figures: in the shape of `diagnose --json`.
    """
    doubt = " Take that as a lead, not as a finding." if is_lead(figures) else ""
    return _judged(figures, "") + _how_likely(figures) + doubt


def _judged(figures: Figures, named: str) -> str:
    """Sound, wrong and why, or wrong and nobody knows why; with the causes in words, if there are any."""
    effects = names_of(figures)
    one, of, namely = len(effects) == 1, _recordings(figures), f": {named}" if named else ""
    wrong = f"Something is {_how_surely(figures)}wrong with {of}"
    if figures["verdict"] == "clean":
        return f"Nothing wrong was found in {of}."
    if figures["verdict"] == "explained" and not effects:
        return f"{wrong}, and no cause is likelier than all others together."
    if figures["verdict"] == "explained" and is_lead(figures):
        best = "one cause describes it best" if one else f"{len(effects)} causes together describe it best"
        return f"{wrong}. Of all that were tried, {best}{namely}."
    if figures["verdict"] == "explained":
        account = "one cause accounts for" if one else f"{len(effects)} causes together account for"
        account += " it" if is_whole(figures) else " most of it" if explains_most(figures) else " much of it"
        return f"{wrong}, and {account}{namely}."
    if effects:
        found = "one cause was found" if one else f"{len(effects)} causes were found"
        within = f" ({named})" if named else ""
        return f"{wrong}; {found}{within}, but that does not account for all of it. The rest is unexplained."
    if _by_size_alone(figures):
        return (
            f"In {of} forces and motion differ by more than they do in sound recordings. Nothing that was "
            "tried accounts for it: recording or model may be at fault."
        )
    return f"{wrong}, and no cause that this program knows accounts for it."


def _by_size_alone(figures: Figures) -> bool:
    """Whether it is unexplained only since much is left: no pattern in it speaks for anything."""
    chances = figures.get("chances")
    unexplained = figures["verdict"] == "unexplained" and not figures["effects"]
    return bool(unexplained and chances and chances["nothing"] > chances["something_else"])


def _numbered(figures: Figures, effects: Sequence[Figures]) -> str:
    """Causes in short, with the numbers that they have on the page where there are several."""
    short = [_in_short(figures, effect) for effect in effects]
    if len(short) == 1:
        return short[0]
    places = [k for k, one in enumerate(figures["effects"], start=1) if any(one is e for e in effects)]
    return "; ".join(f"({k}) {text}" for k, text in zip(places, short, strict=True))


def _how_likely(figures: Figures) -> str:
    """Where nothing is named, the chance of what the verdict says; a kept old answer has none."""
    chances = figures.get("chances")
    if not chances or _by_size_alone(figures):
        return ""
    if figures["verdict"] == "clean":
        return f" The chance that nothing is wrong: {percent(chances['nothing'])}."
    return f" The chance that it is none of the known causes: {percent(chances['something_else'])}."


def _at_fault(figures: Figures) -> str:
    """Recording, model or movement; of a cause whose place another may take, either."""
    groups: dict[str, list[int]] = {}
    for k, effect in enumerate(figures["effects"], start=1):
        if effect in leads_of(figures):
            continue
        others = rivals_of(figures, effect) if effect["confidence"] < CONFIDENT else ()
        faults = dict.fromkeys(about(one).at_fault for one in (effect, *others))
        groups.setdefault(", or else ".join(AT_FAULT[fault] for fault in faults), []).append(k)
    if len(groups) == 1:
        return f"At fault: {next(iter(groups))}."
    said = [f"{whose} ({', '.join(map(str, numbers))})" for whose, numbers in groups.items()]
    return f"At fault: {'; '.join(said)}."


def _how_surely(figures: Figures) -> str:
    """By all that was found together, against nothing being wrong; nothing where nobody knows."""
    nats = figures.get("evidence_nats")
    if not nats:
        return ""
    return "certainly " if is_certain(figures) else "very likely " if nats >= LIKELY_NATS else "probably "


def _only_a_lead(figures: Figures) -> str:
    one = len(names_of(figures)) == 1
    taken = (
        f"{'It is a lead, not a finding' if one else 'They are leads, not findings'}: on withheld stretches "
    )
    taken += f"{changes_in_words(figures['gain'])}."
    if any(effect["confidence"] >= CONFIDENT for effect in figures["effects"]):
        taken += " A sure name is more likely than the other names tried, not certain to be true."
    return taken


ToFlag = Callable[[str, int, int, str], str]  # trial, first frame, end, foot → how to flag them


def by_command(trial: str, start: int, end: int, foot: str) -> str:
    """How to flag frames in a terminal."""
    return f"addb-viewer flag SUBJECT {trial} {start}:{end} --foot {foot} --reason notOverForcePlate"


def cause(figures: Figures, k: int, to_flag: ToFlag = by_command) -> Section:
    """The k-th cause: meaning, size, time, certainty, remedy, and what looks alike.

    Args:
        figures: in the shape of `diagnose --json`.
        k: from 0.
        to_flag: how frames are flagged where this is read.
    """
    effect = figures["effects"][k]
    rivals = rivals_of(figures, effect)
    rows = [
        ("what it is", sentence(effect)),
        ("how large", "; ".join(amounts(effect))),
        ("when", when(figures, effect)),
        ("how sure", certainty(effect["confidence"], len(rivals))),
        ("what to do", " ".join([effect.get("remedy", ""), *_flag_hint(figures, effect, to_flag)]).strip()),
    ]
    if rivals:
        rows.append(("could also be", _could_also_be(effect, rivals)))
        told_apart = dict.fromkeys(r["separate_by"] for r in rivals if r["separate_by"])
        rows.append(("to tell, record", "; or ".join(told_apart)))
    kind = "Lead" if effect in leads_of(figures) else "Cause"
    heading = f"{kind} {k + 1} of {len(figures['effects'])}: {title(effect)}"
    return Section(heading, rows=tuple(row for row in rows if row[1]))


def when(figures: Figures, effect: Figures) -> str:
    """The frames on which a cause acts, as people count them: the last one included."""
    ranges = sorted(ranges_of(figures, effect))
    trials = list(dict.fromkeys(trial for trial, _, _ in ranges))
    if not about(effect).at_certain_frames:
        return f"all the time, in {listed(trials)}" if trials else ""
    said = []
    for trial, start, end in ranges:
        seconds = seconds_of(figures, trial, start, end)
        said.append(f"{trial}, frames {start} to {end - 1}{f' ({seconds})' if seconds else ''}")
    return "; ".join(said)


def how_to_read(figures: Figures) -> Section:
    """What ± and "sure" mean on this page."""
    effects = figures["effects"]
    lines = []
    if any(effect["parameters"] for effect in effects):
        lines.append(f"{SPREAD} It holds if the cause is the right one.")
    if effects:
        lines.append(
            "Certainly, very likely or probably wrong compares everything that was found with nothing being "
            "wrong. How sure a name is compares the cause with all others that were tried in its place, with "
            "no cause, and with unknown causes."
        )
    if any(about(effect).at_certain_frames for effect in effects):
        lines.append("Frames are counted from 0; `flag` takes the first one and the one after the last.")
    if figures["verdict"] != "clean":
        lines.append(f"Tried, each alone and together with the others: {looked_for()}.")
    return Section("How to read this", tuple(lines))


def _in_short(figures: Figures, effect: Figures) -> str:
    """A cause with how sure its name is, or with what may be in its place."""
    rivals = rivals_of(figures, effect)
    if rivals and effect["confidence"] < CONFIDENT:
        named = [f"{title(effect)}{share(effect['confidence'])}"]
        named += [f"{instead_of(effect, rival)}{share(rival.get('confidence'))}" for rival in rivals]
        return " — or else ".join(named)
    return f"{title(effect)} [{certainty(effect['confidence'], len(rivals)).split(' (')[0].split(':')[0]}]"


def _could_also_be(effect: Figures, rivals: Sequence[Figures]) -> str:
    """The rivals, and what is left for causes that are not listed, where that is known and worth telling."""
    shares = [rival.get("confidence") for rival in rivals]
    said = [f"{instead_of(effect, r)}{share(of_r)}" for r, of_r in zip(rivals, shares, strict=True)]
    left = 1.0 - effect["confidence"] - sum(filter(None, shares))
    if all(shares) and left >= LEAST_ELSE:
        said.append(f"anything else{share(left)}")
    return "; ".join(said)


def instead_of(effect: Figures, rival: Figures) -> str:
    """A rival's title; of the same cause elsewhere only where."""
    return target_in_words(rival["target"]) if rival["id"] == effect["id"] else title(rival)


def _recordings(figures: Figures) -> str:
    trials = figures.get("trials", ())
    concerned = trials_in_question(figures)
    if len(concerned) < len(trials):
        name = f"the recording '{concerned[0]}'" if len(concerned) == 1 else f"recordings {listed(concerned)}"
        return f"{name} (of {listed(trials)})"
    if len(trials) == 1:
        return f"the recording '{trials[0]}'"
    return f"these recordings ({listed(trials)})" if trials else "this recording"


def _flag_hint(figures: Figures, effect: Figures, to_flag: ToFlag) -> list[str]:
    if about(effect).mend is not Mend.FLAGGED:
        return []
    several = effect["target"].startswith("plate_") or "+" in effect["target"]
    foot = "both" if several else effect["target"]
    return [
        f"{TO_FLAG.lstrip()}{to_flag(trial, start, end, foot)}."
        for trial, start, end in sorted(ranges_of(figures, effect))
    ]
