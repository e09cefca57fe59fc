"""Whether causes hold up on stretches that were hidden: force and moment predicted without and with them."""

from collections.abc import Mapping
from dataclasses import dataclass

from addb_viewer.text.diagnosis_vocabulary import about, names_of
from addb_viewer.text.residual_words import corrected_causes, in_markers
from solver.diagnosis.causes.about import TimeHistory
from solver.diagnosis.diagnosis import Gain
from solver.diagnosis.diagnosis_report import DiagnosisReport

AS_BEFORE = 0.05  # relative: less than that is no difference
PREDICTED = (  # what, its key, unit
    ("force", "held_out_linear_residual_N", "N"),
    ("moment", "held_out_angular_residual_Nm", "N·m"),
)
STEP = 0.1  # of a figure: what its last digit may be at most
MOST_DIGITS = 2


@dataclass(frozen=True)
class Change:
    """How one figure on hidden stretches changes with the causes, in words."""

    words: str
    surely_falls: bool
    rises: bool


def changes(gain: Mapping[str, Gain]) -> list[Change]:
    """Of force and moment, those that are told."""
    return [_change(what, gain[key], unit) for what, key, unit in PREDICTED if key in gain]


def digits_of(figure: float) -> int:
    """Decimals that a change of a tenth shows in."""
    return next((d for d in range(MOST_DIGITS) if 10.0**-d <= STEP * figure), MOST_DIGITS)


def changes_in_words(gain: Mapping[str, Gain]) -> str:
    """The changes as one clause."""
    return "; ".join(change.words for change in changes(gain))


def is_tentative(figures: DiagnosisReport) -> bool:
    """Whether the causes are no more than tentative, since hidden stretches do not speak for them.

    They do where force or moment surely falls and neither rises. Of what lies in the markers, has a force of
    its own each time, or is a steady weight, they cannot tell; nor where masses that are adjusted to the rest
    take a cause's place there, which the whole recording's evidence may speak for all the same.
    """
    told = changes(figures.gain)
    if (
        not told
        or not names_of(figures)
        or in_markers(figures)
        or corrected_causes(figures)
        or now_and_then(figures)
        or only_weights(figures)
    ):
        return False
    return any(c.rises for c in told) or not (is_certain(figures) or any(c.surely_falls for c in told))


def is_certain(figures: DiagnosisReport) -> bool:
    """Whether something is wrong beyond doubt, by the threshold of the diagnosis' own settings."""
    least = figures.certain_nats
    return bool((figures.evidence_nats or 0.0) >= least)


def now_and_then(figures: DiagnosisReport) -> bool:
    """Whether a cause has a force of its own each time."""
    return any(about(effect).time_history is TimeHistory.NOW_AND_THEN for effect in figures.effects)


def speeds_up(figures: DiagnosisReport) -> bool:
    """Whether a cause is a belt or platform that accelerates."""
    return any(about(effect).time_history is TimeHistory.ALL_ALONG for effect in figures.effects)


def only_weights(figures: DiagnosisReport) -> bool:
    """Whether every cause is a weight that acts all along, of the person or not."""
    effects = figures.effects
    return bool(effects) and all(about(effect).weight is not None for effect in effects)


def was_ordinary(figures: DiagnosisReport) -> bool:
    """Whether force on hidden stretches was no more than in sound recordings without the causes."""
    force = figures.gain.get("held_out_linear_residual_N")
    return force is not None and bool(force.before <= figures.remaining.noise_floor_N)


def unforeseeable(figures: DiagnosisReport) -> str:
    """Why force cannot fall on hidden stretches; empty where it can."""
    if now_and_then(figures):
        return (
            "The force of a step or a contact is different each time and cannot be predicted when its frames "
            "are held out, so these figures stay high there, or rise. The evidence for it is the place, time "
            "and sign of the force."
        )
    if speeds_up(figures):
        return (
            "How a belt accelerates in a held-out stretch cannot be predicted: a force error that stays high "
            "is evidence neither for the belt nor against it."
        )
    if only_weights(figures):
        return (
            "Without the cause, the person's masses are adjusted to the rest of the recording instead: these "
            "figures cannot test a constant weight. The evidence for the cause is how far the weight on the "
            "plates is from the entered one."
        )
    return ""


def _change(what: str, gain: Gain, unit: str) -> Change:
    before, after, interval = gain.before, gain.after, gain.interval
    digits = digits_of(after)
    both = f"{before:.{digits}f} → {after:.{digits}f} {unit}"
    surely_falls = interval is not None and interval[1] < before
    rises = after > (1 + AS_BEFORE) * before
    by_chance = rises and interval is not None and interval[0] <= before
    rises = rises and not by_chance
    if surely_falls:
        words = f"{what} falls by {100 * (1 - after / before):.0f} %, more than by chance ({both})"
    elif by_chance:
        words = f"{what} is higher, but that may be chance ({both})"
    elif rises:
        words = f"{what} rises ({both})"
    elif after >= (1 - AS_BEFORE) * before:
        words = f"{what} stays as it is ({both})"
    else:
        words = f"{what} is lower, but that may be chance ({both})"
    return Change(words, surely_falls, rises)
