"""The verdict of a diagnosis in words: sound, or wrong and why, or wrong and nobody knows why."""

from collections.abc import Sequence

from addb_viewer.text.cause_words import instead_of
from addb_viewer.text.diagnosis_vocabulary import (
    CONFIDENT,
    about,
    capital,
    certainty,
    listed,
    names_of,
    percent,
    rivals_of,
    share,
    tentative_of,
    title,
)
from addb_viewer.text.gain_words import changes_in_words, is_certain, is_tentative
from addb_viewer.text.remainder_words import explains_most
from addb_viewer.text.residual_words import is_whole
from addb_viewer.text.sections import Section
from addb_viewer.text.use_words import trials_in_question, use
from solver.common.notes import Kind
from solver.diagnosis.causes.about import AtFault
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport
from solver.kinematics.unseen_bodies import UNSEEN_MASS

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


def verdict(figures: DiagnosisReport) -> Section:
    """Sound, wrong and why, or wrong and nobody knows why; and whether the names are more than tentative."""
    effects, tentative = names_of(figures), tentative_of(figures)
    text = _judged(figures, _numbered(figures, effects))
    if tentative:
        also = "Besides, a" if effects else "A"
        also += " tentative cause" if len(tentative) == 1 else " few tentative causes"
        text += f" {also}, likelier wrong than right: {_numbered(figures, tentative)}."
    text += _how_likely(figures) + _unseen(figures)
    whose = [_at_fault(figures)] if effects else []
    early = [ENDED_EARLY] if figures.ended_early else []
    doubt = [_only_tentative(figures)] if is_tentative(figures) else []
    weighed = [f"{capital(note)}." for note in figures.notes if note.kind is Kind.ENTERED_MASS]
    first = weighed if figures.verdict == "unexplained" else []  # with a wrong mass, causes mean little
    return Section("Verdict", (*first, text, *whose, *early, *doubt, use(figures)))


def headline(figures: DiagnosisReport) -> str:
    """The verdict in a sentence, for where the causes stand below it."""
    doubt = " Take that as tentative, not as a finding." if is_tentative(figures) else ""
    return _judged(figures, "") + _how_likely(figures) + _unseen(figures) + doubt


def _judged(figures: DiagnosisReport, named: str) -> str:
    """Sound, wrong and why, or wrong and nobody knows why; with the causes in words, if there are any."""
    effects = names_of(figures)
    one, of, namely = len(effects) == 1, _recordings(figures), f": {named}" if named else ""
    files_are_right = effects and all(about(effect).at_fault is AtFault.MOVEMENT for effect in effects)
    what, how = ("Forces are", "missing from") if files_are_right else ("Something is", "wrong with")
    wrong = f"{what} {_how_surely(figures)}{how} {of}"
    if figures.verdict == "clean":
        return f"Nothing wrong was found in {of}."
    if figures.verdict == "explained" and not effects:
        return f"{wrong}, and no cause is likelier than all others together."
    if figures.verdict == "explained" and is_tentative(figures):
        best = "one cause describes it best" if one else f"{len(effects)} causes together describe it best"
        return f"{wrong}. Of all that were tried, {best}{namely}."
    if figures.verdict == "explained":
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


def _by_size_alone(figures: DiagnosisReport) -> bool:
    """Whether it is unexplained only since much is left: no pattern in it speaks for anything."""
    chances = figures.chances
    unexplained = figures.verdict == "unexplained" and not figures.effects
    return bool(unexplained and chances and chances.nothing > chances.something_else)


def _numbered(figures: DiagnosisReport, effects: Sequence[Cause]) -> str:
    """Causes in short, with the numbers that they have on the page where there are several."""
    short = [_key_findings(figures, effect) for effect in effects]
    if len(short) == 1:
        return short[0]
    places = [k for k, one in enumerate(figures.effects, start=1) if any(one is e for e in effects)]
    return "; ".join(f"({k}) {text}" for k, text in zip(places, short, strict=True))


def _how_likely(figures: DiagnosisReport) -> str:
    """Where nothing is named, the chance of what the verdict says; a kept old answer has none."""
    chances = figures.chances
    if not chances or _by_size_alone(figures):
        return ""
    if figures.verdict == "clean":
        return f" The chance that nothing is wrong: {percent(chances.nothing)}."
    return f" The chance that it is none of the known causes: {percent(chances.something_else)}."


def _unseen(figures: DiagnosisReport) -> str:
    """Where something stays unexplained, how much of the body moves by a guess that may be it."""
    share = max((float(note.values.get(UNSEEN_MASS, 0.0)) for note in figures.notes), default=0.0)
    if figures.verdict != "unexplained" or not share:
        return ""
    return f" No marker shows how {percent(share)} of the mass moves, and it may be that."


def _at_fault(figures: DiagnosisReport) -> str:
    """Recording, model or movement; of a cause whose place another may take, either."""
    groups: dict[str, list[int]] = {}
    for k, effect in enumerate(figures.effects, start=1):
        if effect in tentative_of(figures):
            continue
        others = rivals_of(figures, effect) if effect.confidence < CONFIDENT else ()
        faults = dict.fromkeys(about(one).at_fault for one in (effect, *others))
        groups.setdefault(", or else ".join(AT_FAULT[fault] for fault in faults), []).append(k)
    if len(groups) == 1:
        return f"At fault: {next(iter(groups))}."
    said = [f"{whose} ({', '.join(map(str, numbers))})" for whose, numbers in groups.items()]
    return f"At fault: {'; '.join(said)}."


def _how_surely(figures: DiagnosisReport) -> str:
    """By all that was found together, against nothing being wrong; nothing where nobody knows."""
    nats = figures.evidence_nats
    if not nats:
        return ""
    return "certainly " if is_certain(figures) else "very likely " if nats >= LIKELY_NATS else "probably "


def _only_tentative(figures: DiagnosisReport) -> str:
    one = len(names_of(figures)) == 1
    taken = (
        f"{'It is tentative, not a finding' if one else 'They are tentative, not findings'}: on held-out "
        "stretches "
    )
    taken += f"{changes_in_words(figures.gain)}."
    if any(effect.confidence >= CONFIDENT for effect in figures.effects):
        taken += " A sure name is more likely than the other names tried, not certain to be true."
    return taken


def _key_findings(figures: DiagnosisReport, effect: Cause) -> str:
    """A cause with how sure its name is, or with what may be in its place."""
    rivals = rivals_of(figures, effect)
    if rivals and effect.confidence < CONFIDENT:
        named = [f"{title(effect)}{share(effect.confidence)}"]
        named += [f"{instead_of(effect, rival)}{share(rival.confidence)}" for rival in rivals]
        return " — or else ".join(named)
    return f"{title(effect)} [{certainty(effect.confidence, len(rivals)).split(' (')[0].split(':')[0]}]"


def _recordings(figures: DiagnosisReport) -> str:
    trials = figures.trials
    concerned = trials_in_question(figures)
    if len(concerned) < len(trials):
        name = f"the recording '{concerned[0]}'" if len(concerned) == 1 else f"recordings {listed(concerned)}"
        return f"{name} (of {listed(trials)})"
    if len(trials) == 1:
        return f"the recording '{trials[0]}'"
    return f"these recordings ({listed(trials)})" if trials else "this recording"
