"""Words for a diagnosis: causes, targets, amounts and certainty as somebody in a laboratory says them."""

import math
import re
from collections.abc import Mapping, Sequence

from addb_viewer.text.evidence_words import plain
from solver.diagnosis.causes.about import About, Named, Place, Reading, of_each_trial
from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, Figure, Rival

CONFIDENT = 0.9  # share of a cause, from which on others in its place are no reason to wait
LEAST_TOLD = 0.005  # of a share
STDS_OF_A_SPREAD = 2  # the true value lies within in 19 of 20 cases
FRACTION_DIGITS = 4  # at most
TWO_DIGITS_BELOW = 1.95  # first digits of a spread: ± 1.4 rounded to one digit would be a third off

_OF_THEIR_OWN = {target: words for one in ABOUT.values() for target, words in one.targets.items()}
BODIES = {
    "calcn": "foot",
    "femur": "thigh",
    "tibia": "shank",
    "talus": "ankle",
    "toes": "toes",
    "patella": "kneecap",
    "humerus": "upper arm",
    "ulna": "forearm",
    "radius": "forearm",
    "hand": "hand",
    "torso": "trunk",
}


def about(effect: Cause | Rival) -> About:
    """Everything that is known of a cause; of an id that nobody knows any more, only that.

    Args:
        effect: with `id`, of `effects` or `alternatives`.
    """
    id = str(effect.id)
    return ABOUT.get(id, About(id))


def tentative_of(figures: DiagnosisReport) -> list[Cause]:
    """Causes that are likelier wrong than right: no names, but where to look."""
    return [effect for effect in figures.effects if effect.is_tentative]


def names_of(figures: DiagnosisReport) -> list[Cause]:
    """All others."""
    return [effect for effect in figures.effects if not effect.is_tentative]


def trials_of_causes(figures: DiagnosisReport) -> list[str]:
    """Trials on which some cause acts, in the recordings' order."""
    concerned = {trial for effect in figures.effects for trial, _, _ in effect.frames}
    return [trial for trial in figures.trials if trial in concerned]


def rivals_of(figures: DiagnosisReport, effect: Cause) -> list[Rival]:
    """Alternatives that this recording cannot tell from a cause."""
    name, several = f"{effect.id} {effect.target}", len(figures.effects) > 1
    return [a for a in figures.alternatives if (a.instead_of or (None if several else name)) == name]


def seconds_of(figures: DiagnosisReport, trial: str, start: int, end: int) -> str:
    """A stretch on the recording's clock, both ends included; empty where nobody knows its rate."""
    rate = figures.rates_Hz.get(trial)
    if not rate:
        return ""
    begin = figures.starts_s.get(trial, 0.0)
    return f"{begin + start / rate:.2f} to {begin + (end - 1) / rate:.2f} s"


def title(effect: Cause | Rival) -> str:
    """A cause in a few words, with its target; a cause that has no words yet by its id.

    Args:
        effect: with `id` and `target`, of `effects` or `alternatives`.
    """
    words = about(effect).title
    if not words:
        return f"{effect.id.replace('_', ' ')} ({effect.target})"
    return words.format(target=target_in_words(effect.target))


def short_title(effect: Cause | Rival) -> str:
    """Its title without the model's name of what is told in words."""
    return re.sub(r" \([^()]*\)$", "", title(effect))


def target_in_words(target: str) -> str:
    """What a target is called, with the name in the files and the model where that differs."""
    if target in _OF_THEIR_OWN:
        return _OF_THEIR_OWN[target]
    parts = target.split("+")
    words = [part_in_words(part) for part in parts]
    if words == parts or all(part.startswith("plate_") for part in parts):
        return listed(words)
    return f"{listed(words)} ({', '.join(parts)})"


def sentence(effect: Cause) -> str:
    """What a cause means: the effect's own sentence, with its target in words."""
    told, target = str(effect.sentence), str(effect.target)
    if target in told and target not in _OF_THEIR_OWN and target != "all":
        on_body = about(effect).names is Named.BODIES
        words = _with_articles(target) if on_body else target_in_words(target)
        told = re.sub(rf"(?<!\w){re.escape(target)}(?!\w)", words, told)
    elif target in _OF_THEIR_OWN:
        told = told.replace(f"({target})", f"({target_in_words(target)})")
    return capital(told)


def capital(text: str) -> str:
    """As a sentence begins."""
    return text[:1].upper() + text[1:]


def amounts(effect: Cause) -> list[str]:
    """How large a cause is, each parameter with the spread within which it lies in 19 of 20 cases."""
    said: list[str] = []
    hardly: list[str] = []  # told only where nothing else is
    for reading in of_each_trial(about(effect).readings, effect.parameters):
        if isinstance(reading, Place):
            said += _placed(reading, effect.parameters)
            continue
        estimate = effect.parameters.get(reading.parameter)
        if estimate is not None and estimate.value is not None:
            away = estimate.value - reading.zero
            hardly_told = abs(away) < (estimate.std or 0.0)
            (hardly if hardly_told else said).append(_said(reading, away, estimate.std))
    return said or hardly


def amount(value: float, spread: float | None, unit: str) -> str:
    """A figure with its spread, with no more digits than the spread leaves sense in."""
    after = behind(unit)
    if not spread or not math.isfinite(spread):
        return f"{plain(value)}{after}"
    leading = spread / 10.0 ** math.floor(math.log10(spread))
    digits = (1 if leading < TWO_DIGITS_BELOW else 0) - math.floor(math.log10(spread))
    digits = min(max(digits, 0), FRACTION_DIGITS)
    least = 10.0**-digits
    return f"{value:.{digits}f} ± {max(spread, least):.{digits}f}{after}"


def behind(unit: str) -> str:
    """A unit as it stands behind a figure."""
    return f"{'' if unit in ('', '°') else ' '}{unit}"


def certainty(confidence: float, rivals: int) -> str:
    """How sure a cause is, in words and in per cent."""
    if rivals and confidence >= CONFIDENT:
        others = "another cause remains" if rivals == 1 else f"{rivals} other causes remain"
        return f"fairly sure of the name ({percent(confidence)}); {others} possible, see below"
    if rivals:
        return (
            f"one of {rivals + 1} causes that come near, see below, and this recording does not decide; "
            f"this one {percent(confidence)}"
        )
    if confidence >= 0.99:
        return "very sure of the name (more than 99 %)"
    if confidence >= CONFIDENT:
        return f"fairly sure of the name ({percent(confidence)})"
    if confidence >= 0.5:
        return f"not sure: more likely than any other single cause ({percent(confidence)})"
    return f"a guess: less likely than all other causes together ({percent(confidence)})"


def sureness(confidence: float) -> str:
    """How sure a cause is, in per cent alone."""
    return "> 99 %" if confidence > 0.99 else percent(confidence)  # nobody cares for more digits


def share(confidence: float | None) -> str:
    """Of a rival, in brackets; nothing where nobody knows."""
    return "" if confidence is None else f" ({percent(confidence)})"


def upward(force_N: Sequence[float]) -> str:
    """The direction of a force in the room, y up."""
    x, y, z = force_N
    size = math.sqrt(x * x + y * y + z * z)
    if size == 0:
        return "nowhere"
    if abs(y) > 0.8 * size:
        return "up" if y > 0 else "down"
    longest_first = sorted((("x", x), ("z", z)), key=lambda axis: -abs(axis[1]))
    told = [axis for k, axis in enumerate(longest_first) if not k or abs(axis[1]) > 0.4 * size]
    level = "along " + " and ".join(f"{'+' if force > 0 else '−'}{name}" for name, force in told)
    if abs(y) < 0.4 * size:
        return level
    return f"{'up' if y > 0 else 'down'} and {level}"


def _said(reading: Reading, away: float, std: float | None) -> str:
    value, spread = reading.factor * away, _spread(std, reading.factor)
    signed = f"{'+' if value >= 0 else '−'}{amount(abs(value), None, reading.unit)}"
    if reading.which is None:
        return reading.text.format(amount=amount(value, spread, reading.unit), signed=signed)
    which = reading.which[0] if value >= 0 else reading.which[1]
    return reading.text.format(amount=amount(abs(value), spread, reading.unit), which=which, signed=signed)


def _placed(place: Place, parameters: Mapping[str, Figure]) -> list[str]:
    """A point in one sentence; nothing where a coordinate is not known."""
    known: dict[str, tuple[float, float | None]] = {}
    for axis in "xyz":
        figure = parameters.get(place.parameters.format(axis))
        if figure is None or figure.value is None:
            return []
        known[axis] = place.factor * figure.value, _spread(figure.std, place.factor)
    point = ", ".join(
        f"{axis} {amount(value, spread, place.unit)}" for axis, (value, spread) in known.items()
    )
    distance = math.hypot(*(value for value, _ in known.values()))
    spread = max(spread or 0.0 for _, spread in known.values())
    if spread > distance:
        return [place.unknown]
    told = amount(distance, spread, place.unit)
    return [place.text.format(point=point.replace(" -", " −"), distance=told)]


def _spread(std: float | None, factor: float) -> float | None:
    return None if std is None else STDS_OF_A_SPREAD * factor * std


def _with_articles(target: str) -> str:
    """Bodies within a sentence: "the right foot (calcn_r)"; plates and what has no words as they are."""
    parts = target.split("+")
    words = [part_in_words(part) for part in parts]
    said = listed([w if p.startswith("plate_") else f"the {w}" for w, p in zip(words, parts, strict=True)])
    return (
        said
        if words == parts or any(p.startswith("plate_") for p in parts)
        else f"{said} ({', '.join(parts)})"
    )


def part_in_words(name: str) -> str:
    """A plate or a body as people call it; any other name as it is."""
    plate = re.fullmatch(r"plate_(\d+)", name)
    if plate:
        return f"plate {plate[1]}"
    stem, _, side = name.rpartition("_")
    if side in ("r", "l") and stem:
        return f"{'right' if side == 'r' else 'left'} {BODIES.get(stem, stem)}"
    return BODIES.get(name, name)


def listed(words: Sequence[str]) -> str:
    """One, two and three."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= LEAST_TOLD else "less than 1 %"


def newtons(force_N: float) -> str:
    """A force in whole newtons, a small one with a decimal."""
    return f"{force_N:.0f} N" if force_N >= 10 else f"{force_N:.1f} N"
