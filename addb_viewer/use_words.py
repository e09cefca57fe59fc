"""What a recording with this diagnosis is good for, in one line.

Takes the plain values of `diagnose --json`.
"""

from collections.abc import Mapping
from typing import Any

from addb_viewer.detectable_words import cannot_tell
from addb_viewer.diagnosis_vocabulary import CONFIDENT, listed, rivals_of
from addb_viewer.gain_words import now_and_then
from addb_viewer.residual_words import IN_MARKERS, in_markers, is_whole

TAKEN_OFF = "taken off as its zero level"  # says the cause that reading the files puts right

Figures = Mapping[str, Any]


def put_right_on_reading(effect: Figures) -> bool:
    """Whether every fit is without a cause already."""
    return TAKEN_OFF in effect["sentence"]


def use(figures: Figures) -> str:
    """Whether to use the recording as it is, and for what."""
    if figures["verdict"] == "clean":
        below = "what might be there and would not have been found is told below."
        blind = cannot_tell(figures)
        return (
            f"Use: as it is, but it cannot tell {listed(blind)}; {below}"
            if blind
            else f"Use: as it is; {below}"
        )
    if figures["verdict"] != "explained":
        rest = "what remains" if figures["effects"] else "the cause"
        return (
            f"Use: not for joint torques, before {rest} is understood; for joint angles with care, since the "
            "motion may be at fault as well."
        )
    angles = "" if _doubts_the_markers(figures) else "for joint angles as it is; "
    left = [effect for effect in figures["effects"] if not put_right_on_reading(effect)]
    if not left:
        return "Use: as it is; what was wrong is put right on reading."
    if in_markers(figures):
        return (
            "Use: neither for joint angles nor for torques near those markers, before they are mended; the "
            "forces are not in doubt."
        )
    if all(effect["id"] == "off_plate_step" for effect in left):
        return "Use: outside the frames named below; flag these first."
    if any(_other_causes(figures, effect) for effect in left):
        return f"Use: {angles}not for joint torques, before it is known which cause it is."
    causes = "the cause" if len(left) == 1 else "the causes"
    whole = is_whole(figures) or now_and_then(figures)  # a step's own force no hidden stretch foretells
    rest = "" if whole else ", and then with care, since not all is explained (see what remains)"
    return f"Use: {angles}for joint torques only with {causes} put right (see what next){rest}."


def _doubts_the_markers(figures: Figures) -> bool:
    return any(effect["id"] in (*IN_MARKERS, "capture_scale") for effect in figures["effects"])


def _other_causes(figures: Figures, effect: Figures) -> bool:
    """Whether something of another kind may be in a cause's place; another place of the same is no matter."""
    unsure = effect["confidence"] < CONFIDENT
    return unsure and any(rival["id"] != effect["id"] for rival in rivals_of(figures, effect))
