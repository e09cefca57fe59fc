"""One cause of a diagnosis in words: what it is, how large, when, how sure, what to do, what looks alike."""

import shlex
from collections.abc import Callable, Sequence

from addb_viewer.text.diagnosis_vocabulary import (
    about,
    amounts,
    capital,
    certainty,
    listed,
    percent,
    rivals_of,
    seconds_of,
    sentence,
    share,
    target_in_words,
    tentative_of,
    title,
)
from addb_viewer.text.residual_words import corrected_on_reading
from addb_viewer.text.sections import Section
from solver.diagnosis.causes.about import CorrectedBy
from solver.diagnosis.deciding.deciding_trial import NOTHING
from solver.diagnosis.diagnosis import ToBeSure
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, Rival
from solver.diagnosis.unmodelled.open_world import OUTSIDE_THE_LIST

TO_BE_SURE = "to be sure, record"
EVEN = 1.5  # odds below it are even
MOST_ODDS = 1000  # no diagnosis is surer
LEAST_ELSE = 0.05  # of the certainty, for causes that are not listed
TO_FLAG = " To flag: "  # before each command that somebody may copy
ToFlag = Callable[[str, int, int, str], str]  # trial, first frame, end, foot → how to flag them


def by_command(trial: str, start: int, end: int, foot: str) -> str:
    """How to flag frames in a terminal."""
    said = f"addb-viewer flag SUBJECT {shlex.quote(trial)} {start}:{end} --foot {foot}"
    return f"{said} --reason notOverForcePlate"


def cause(figures: DiagnosisReport, k: int, to_flag: ToFlag = by_command) -> Section:
    """The k-th cause: meaning, size, time, certainty, remedy, and what looks alike.

    Args:
        figures: of the diagnosis.
        k: from 0.
        to_flag: how frames are flagged where this is read.
    """
    effect = figures.effects[k]
    rivals = rivals_of(figures, effect)
    already = ["Every fit takes it off already."] if corrected_on_reading(effect) else []
    rows = [
        ("what it is", sentence(effect)),
        ("how large", "; ".join(amounts(effect))),
        ("when", when(figures, effect)),
        ("how sure", certainty(effect.confidence, len(rivals))),
        ("what to do", " ".join([*already, effect.remedy, *_flag_hint(figures, effect, to_flag)]).strip()),
    ]
    if rivals:
        rows.append(("could also be", _could_also_be(effect, rivals)))
        told_apart = dict.fromkeys(r.separate_by for r in rivals if r.separate_by)
        rows.append(("to tell, record", "; or ".join(told_apart)))
    rows.append((TO_BE_SURE, to_be_sure(figures, effect)))
    kind = "Tentative cause" if effect in tentative_of(figures) else "Cause"
    heading = f"{kind} {k + 1} of {len(figures.effects)}: {title(effect)}"
    return Section(heading, rows=tuple(row for row in rows if row[1]))


def to_be_sure(figures: DiagnosisReport, effect: Cause) -> str:
    """Which short trial would decide a cause, and by how much; empty where none is sought for it."""
    asked = figures.to_be_sure
    if asked is None or (asked.id, asked.target) != (effect.id, effect.target):
        return ""
    rival = rival_in_words(asked)
    if asked.trial is None:
        return f"no short trial of the list would tell it from {rival}"
    expected = f"if it is right: {_odds(asked.odds)} become {_odds(asked.odds_after)}"
    if asked.nats < asked.nats_if_other and asked.odds_after <= asked.odds:
        expected = "if that is right instead, it shows"
    return f"{capital(trial_in_words(asked))}. That tells it from {rival}; expected, {expected}."


def trial_in_words(asked: ToBeSure) -> str:
    """What to do, with the plates as people say them."""
    words = asked.words
    for plate in asked.plates:
        words = words.replace(plate, target_in_words(plate))
    return words


def rival_in_words(asked: ToBeSure) -> str:
    """What a name is to be told from."""
    if asked.other_id == NOTHING:
        return "nothing being wrong"
    if asked.other_id == OUTSIDE_THE_LIST:
        return "something that is on no list"
    own, other = Rival(asked.id, asked.target), Rival(asked.other_id, asked.other_target)
    return f"the same at {target_in_words(other.target)}" if own.id == other.id else title(other)


def what_was_decided(figures: DiagnosisReport) -> Section:
    """Whether trials that were recorded since the last diagnosis decided what was not sure in it."""
    after = figures.after_trial
    if after is None:
        return Section("", ())
    name = title(Rival(after.asked.id, after.asked.target))
    now = f"now {percent(after.confidence)}" if after.confidence else "not named any more"
    verb = "decided" if after.decided else "did not decide"
    what = listed(after.trials) if after.trials else "the scale"
    said = f"{capital(what)} {verb} between {name} ({now}) and {rival_in_words(after.asked)}."
    return Section("What the further trial says", (said,))


def _odds(odds: float) -> str:
    if odds < 1.0 / EVEN:
        return f"1 to {_round(1.0 / odds)}"
    return "even odds" if odds < EVEN else f"{_round(odds)} to 1"


def _round(odds: float) -> str:
    return f"{odds:.0f}" if odds < MOST_ODDS else f"more than {MOST_ODDS}"


def when(figures: DiagnosisReport, effect: Cause) -> str:
    """The frames on which a cause acts, as people count them: the last one included."""
    ranges = sorted(effect.frames)
    trials = list(dict.fromkeys(trial for trial, _, _ in ranges))
    if not about(effect).at_certain_frames:
        return f"all the time, in {listed(trials)}" if trials else ""
    said = []
    for trial, start, end in ranges:
        seconds = seconds_of(figures, trial, start, end)
        said.append(f"{trial}, frames {start} to {end - 1}{f' ({seconds})' if seconds else ''}")
    return "; ".join(said)


def _could_also_be(effect: Cause, rivals: Sequence[Rival]) -> str:
    """The rivals, and what is left for causes that are not listed, where that is known and worth telling."""
    shares = [rival.confidence for rival in rivals]
    said = [f"{instead_of(effect, r)}{share(of_r)}" for r, of_r in zip(rivals, shares, strict=True)]
    left = 1.0 - effect.confidence - sum(filter(None, shares))
    if all(shares) and left >= LEAST_ELSE:
        said.append(f"anything else{share(left)}")
    return "; ".join(said)


def instead_of(effect: Cause, rival: Rival) -> str:
    """A rival's title; of the same cause elsewhere only where."""
    return target_in_words(rival.target) if rival.id == effect.id else title(rival)


def _flag_hint(figures: DiagnosisReport, effect: Cause, to_flag: ToFlag) -> list[str]:
    if about(effect).corrected_by is not CorrectedBy.FLAGGED:
        return []
    several = effect.target.startswith("plate_") or "+" in effect.target
    foot = "both" if several else effect.target
    return [
        f"{TO_FLAG.lstrip()}{to_flag(trial, start, end, foot)}."
        for trial, start, end in sorted(effect.frames)
    ]
