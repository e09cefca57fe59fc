"""Why the force of a frame does not count: the words of the B3D format, and the keys that stand for them."""

from dataclasses import dataclass
from difflib import get_close_matches

from annotations.review_errors import ReviewError

REASONS = (
    "notMissingGRF",
    "measuredGrfZeroWhenAccelerationNonZero",
    "unmeasuredExternalForceDetected",
    "torqueDiscrepancy",
    "forceDiscrepancy",
    "notOverForcePlate",
    "missingImpact",
    "missingBlip",
    "shiftGRF",
    "interpolatedClippedGRF",
    "manualReview",
    "footContactDetectedButNoForce",
    "tooHighMarkerRMS",
    "hasInputOutliers",
    "hasNoForcePlateData",
    "velocitiesStillTooHighAfterFiltering",
    "copOutsideConvexFootError",
    "zeroForceFrame",
    "extendedToNearestPeakForce",
)  # a name's place is its number in the format

FORCE_COUNTS = REASONS[0]
MANUAL_REVIEW = "manualReview"


@dataclass(frozen=True)
class ReasonKey:
    """A key of the review app that gives a range its reason."""

    key: str
    words: str  # as the app shows it
    reason: str


REASON_KEYS = (
    ReasonKey("1", "not over a plate", "notOverForcePlate"),
    ReasonKey("2", "foot contact but no force", "footContactDetectedButNoForce"),
    ReasonKey("3", "unmeasured external force", "unmeasuredExternalForceDetected"),
    ReasonKey("4", "centre of pressure outside the foot", "copOutsideConvexFootError"),
    ReasonKey("5", "force wrong", "forceDiscrepancy"),
    ReasonKey("6", "moment wrong", "torqueDiscrepancy"),
    ReasonKey("7", "clipped or interpolated", "interpolatedClippedGRF"),
    ReasonKey("8", "markers bad", "tooHighMarkerRMS"),
    ReasonKey("9", "other", MANUAL_REVIEW),
)

OTHER_WORDS = {
    "measuredGrfZeroWhenAccelerationNonZero": "no force despite acceleration",
    "missingImpact": "impact missing",
    "missingBlip": "short gap in the force",
    "shiftGRF": "force shifted in time",
    "hasInputOutliers": "outliers in the input",
    "hasNoForcePlateData": "no force plate data",
    "velocitiesStillTooHighAfterFiltering": "too fast even when filtered",
    "zeroForceFrame": "force is zero",
    "extendedToNearestPeakForce": "up to the nearest peak",
}  # of the reasons that no key stands for

_KEY_OF = {key.reason: key for key in REASON_KEYS}


def key_of(reason: str) -> str:
    """The key that gives a range this reason; empty where none does."""
    return _KEY_OF[reason].key if reason in _KEY_OF else ""


def reason_words(reason: str) -> str:
    """What people call a reason; a name that is none stays as it is."""
    return _KEY_OF[reason].words if reason in _KEY_OF else OTHER_WORDS.get(reason, reason)


def reason_named(text: str) -> str:
    """The reason that a person means by its name, its words or a key's number; case does not matter.

    Raises:
        ReviewError: no reason of that name; the nearest are listed.
    """
    spoken = {reason.lower(): reason for reason in REASONS}
    spoken |= {reason_words(reason).lower(): reason for reason in REASONS[1:]}
    wanted = " ".join(text.lower().split())
    by_key = {key.key: key.reason for key in REASON_KEYS}
    found = spoken.get(wanted) or by_key.get(wanted)
    if found is None:
        near = [name for name in spoken if wanted and wanted in name]
        near = near or get_close_matches(wanted, spoken, cutoff=0.5) or [key.words for key in REASON_KEYS]
        names = ", ".join(dict.fromkeys(spoken[name] for name in near))
        raise ReviewError(f"no reason '{text}'; nearest: {names}")
    checked_reason(found)
    return found


def checked_reason(reason: str) -> None:
    """Refuse what is no reason for leaving a force out.

    Raises:
        ReviewError: an unknown name, or the one that says that the force counts.
    """
    if reason == FORCE_COUNTS:
        raise ReviewError(f"'{FORCE_COUNTS}' says that the force counts: clear the range instead")
    if reason not in REASONS:
        near = get_close_matches(reason, REASONS) or REASONS[1:]
        raise ReviewError(f"no reason '{reason}'; nearest: {', '.join(near)}")
