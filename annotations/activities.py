"""What a person does during a stretch of a trial: the dataset paper's classes and their subclasses."""

from difflib import get_close_matches

from annotations.review_errors import ReviewError

ACTIVITIES: dict[str, tuple[str, ...]] = {
    "walk": ("overground", "treadmill", "incline"),
    "run": ("overground", "treadmill"),
    "stairs": ("up", "down"),
    "sit-to-stand": (),
    "jump": ("jump", "drop jump", "squat jump", "box jump"),
    "squat": (),
    "lunge": (),
    "standing": ("double support", "single support"),
    "transition": ("start", "end"),
    "other": (),
    "erroneous": (),
}

ERRONEOUS = "erroneous"  # a stretch that must not be used


def activity_words(activity: str, subclass: str | None) -> str:
    """What people call an activity; a subclass that has its word already stands alone: "drop jump"."""
    if subclass is None:
        return activity
    return subclass if activity in subclass.split() else f"{activity} {subclass}"


def checked_activity(activity: str, subclass: str | None) -> None:
    """Refuse an activity or a subclass that the list does not have.

    Raises:
        ReviewError: with the nearest names, or the subclasses that there are.
    """
    if activity not in ACTIVITIES:
        near = get_close_matches(activity, ACTIVITIES) or ACTIVITIES
        raise ReviewError(f"no activity '{activity}'; nearest: {', '.join(near)}")
    known = ACTIVITIES[activity]
    if subclass is not None and subclass not in known:
        raise ReviewError(f"'{activity}' has no subclass '{subclass}'; it has: {', '.join(known) or 'none'}")
