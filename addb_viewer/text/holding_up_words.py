"""Whether causes hold up, as a section: the same figures without and with them, on hidden stretches."""

from addb_viewer.text.diagnosis_vocabulary import capital
from addb_viewer.text.gain_words import (
    PREDICTED,
    changes,
    changes_in_words,
    digits_of,
    is_tentative,
    unforeseeable,
    was_ordinary,
)
from addb_viewer.text.residual_words import corrected_causes, in_markers
from addb_viewer.text.sections import Section
from solver.diagnosis.diagnosis import Gain
from solver.diagnosis.diagnosis_report import DiagnosisReport

CERTAIN_PER_CENT = 95
HOLDS_UP = "Does it hold up?"
MARKER_ERROR = "marker_rms_m"
FOR_MARKERS = (
    "Forces predicted on held-out stretches do not test markers. The evidence for a fault of markers is how "
    "these move relative to the others."
)
TAKEN_IN = (
    "Without the cause, masses and soft tissue that are adjusted to the rest of the recording take its place "
    "there. The evidence for the cause is the recording as a whole."
)


def what_it_gains(figures: DiagnosisReport) -> Section:
    """The same figures without and with the causes, on stretches that were hidden."""
    gain = figures.gain
    if not gain:
        return Section(HOLDS_UP)
    judged = not in_markers(figures)
    told = [(*predicted, 1.0) for predicted in PREDICTED] if judged else []
    if MARKER_ERROR in gain and gain[MARKER_ERROR].after != gain[MARKER_ERROR].before:
        told.append(("markers", MARKER_ERROR, "mm", 1e3))
    rows = [
        (label, before_and_after(gain[key], unit, factor, digits_of(factor * gain[key].after)))
        for label, key, unit, factor in told
        if key in gain
    ]
    lines = []
    if not judged:
        lines.append(FOR_MARKERS)
        if rows:
            lines.append("Distance of markers from the model, without → with the named causes.")
    elif changes(gain):
        lines.append(
            "Stretches of at most about half a second were held out and predicted from the rest of the "
            "recording, without → with the named causes. These are the errors. They are not comparable with "
            "the residual at the top: here masses and soft tissue are first adjusted to the rest of the "
            "recording."
        )
        lines.append(_worth(figures))
    return Section(HOLDS_UP, tuple(lines), tuple(rows))


def before_and_after(gain: Gain, unit: str, factor: float, digits: int) -> str:
    """A figure without and with the causes, and between which bounds the latter lies."""
    text = f"{factor * gain.before:.{digits}f} → {factor * gain.after:.{digits}f} {unit}"
    if gain.interval:
        low, high = (factor * bound for bound in gain.interval)
        between = f"between {low:.{digits}f} and {high:.{digits}f} with {CERTAIN_PER_CENT} % certainty"
        text += f"   (the latter {between})"
    return text


def _worth(figures: DiagnosisReport) -> str:
    """What the figures on hidden stretches say of the causes."""
    gain = figures.gain
    told, each = changes_in_words(gain), changes(gain)
    said = [f"{capital(told)}."]
    holds = each[0].surely_falls and not any(change.rises for change in each)
    if corrected_causes(figures):
        said.append("The evidence for the cause is what the plate read while nobody stood on it.")
    elif not holds and unforeseeable(figures):
        said.append(unforeseeable(figures))
    elif not any(change.surely_falls for change in each) and not is_tentative(figures):
        said.append(TAKEN_IN)
    elif was_ordinary(figures):
        said.append("The force error is ordinary there without them as well, so it does not decide.")
    if is_tentative(figures):
        one = len(figures.effects) == 1
        said.append(
            f"Take the {'cause' if one else 'causes'} as tentative, not as "
            f"{'a finding' if one else 'findings'}."
        )
    return " ".join(said)
