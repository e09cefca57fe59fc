"""The kinds of movement that can be suggested, and a suggestion."""

from dataclasses import dataclass
from enum import StrEnum


class Activity(StrEnum):
    """What a person does: the dataset paper's classes but its last, "other", which nothing suggests."""

    WALKING = "walking"
    RUNNING = "running"
    STAIRS = "stairs"
    SIT_TO_STAND = "sit-to-stand"
    JUMP = "jump"
    SQUAT = "squat"
    LUNGE = "lunge"
    STANDING = "standing"
    TRANSITION = "transition"


class Kind(StrEnum):
    """A sub-label, where something tells it."""

    OVERGROUND = "overground"
    TREADMILL = "treadmill"
    INCLINE = "incline"
    UP = "up"
    DOWN = "down"
    PLAIN_JUMP = "jump"
    DROP_JUMP = "drop jump"
    SQUAT_JUMP = "squat jump"
    BOX_JUMP = "box jump"
    BOTH_FEET = "both feet"
    ONE_FOOT = "one foot"
    START = "start"
    END = "end"


LEARNT = (Activity.WALKING, Activity.RUNNING, Activity.JUMP, Activity.SQUAT, Activity.STANDING)
"""Classes of which there are examples; the others keep the thresholds of `activity_rules`."""

BY_RULE, BY_UNLEARNT_RULE = "rule", "rule (unlearnt)"


@dataclass(frozen=True)
class ActivitySuggestion:
    """Frames start to end − 1 of a trial and what the person seems to do there."""

    start: int
    end: int
    activity: Activity
    kind: Kind | None
    confidence: float  # 0 to 1: how often such a suggestion is right
    by: str = BY_RULE
