"""What a recording with this diagnosis is good for, in one line.

Takes the plain values of `diagnose --json`.
"""

from collections.abc import Mapping
from typing import Any

from addb_viewer.detectable_words import cannot_tell
from addb_viewer.diagnosis_vocabulary import (
    CONFIDENT,
    listed,
    rivals_of,
    target_in_words,
    trials_of_causes,
)
from addb_viewer.gain_words import now_and_then
from addb_viewer.residual_words import IN_MARKERS, in_markers, is_whole, put_right, put_right_on_reading

Figures = Mapping[str, Any]


def use(figures: Figures) -> str:
    """Whether to use the recording as it is, and for what; of several trials, which."""
    concerned = trials_of_causes(figures)
    others = [trial for trial in figures.get("trials", ()) if trial not in concerned]
    if figures["verdict"] == "explained" and concerned and others:
        return f"Use: {listed(others)} as it is. {listed(concerned)}: {_use(figures)}"
    return f"Use: {_use(figures)}"


def _use(figures: Figures) -> str:
    if figures["verdict"] == "clean":
        below = "what might be there and would not have been found is told below."
        blind = cannot_tell(figures)
        but = f", but it cannot tell {listed(blind)}" if blind else ""
        return f"for joint angles and torques as it is{but}; {below}"
    if figures["verdict"] != "explained":
        rest = "what remains" if figures["effects"] else "the cause"
        return (
            f"not for joint torques, before {rest} is understood; for joint angles with care, since the "
            "motion may be at fault as well."
        )
    angles = "" if _doubts_the_markers(figures) else "for joint angles as it is; "
    left = [effect for effect in figures["effects"] if not put_right_on_reading(effect)]
    if put_right(figures):
        return (
            "as it is, since this program puts right on reading what was wrong. The files still hold it: "
            "other programs must be told."
        )
    if in_markers(figures):
        flesh = [effect["target"] for effect in left if effect["id"] == "soft_tissue"]
        if len(flesh) == len(left):
            where = listed([target_in_words(target) for target in flesh])
            return (
                f"not for angles and torques of the joints at the {where}, which nothing mends afterwards; "
                "else as it is."
            )
        return (
            "for angles and torques of the joints at those markers only once these are mended; else as it is."
        )
    if all(effect["id"] == "off_plate_step" for effect in left):
        return "outside the frames named below; flag these first."
    if any(_other_causes(figures, effect) for effect in left):
        return f"{angles}not for joint torques, before it is known which cause it is."
    causes = "the cause" if len(left) == 1 else "the causes"
    whole = is_whole(figures) or now_and_then(figures)  # a step's own force no hidden stretch foretells
    rest = "" if whole else ", and then with care, since not all is explained (see what remains)"
    return f"{angles}for joint torques only with {causes} put right (see what next){rest}."


def _doubts_the_markers(figures: Figures) -> bool:
    return any(effect["id"] in (*IN_MARKERS, "capture_scale") for effect in figures["effects"])


def _other_causes(figures: Figures, effect: Figures) -> bool:
    """Whether something of another kind may be in a cause's place; another place of the same is no matter."""
    unsure = effect["confidence"] < CONFIDENT
    return unsure and any(rival["id"] != effect["id"] for rival in rivals_of(figures, effect))
