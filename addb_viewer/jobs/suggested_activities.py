"""What the solver believes that a person does, in the words of the review log."""

from annotations.suggested_activity import SuggestedActivity
from solver.fitting.fit_result import TrialFit
from solver.gait.activity import Activity, ActivitySuggestion, Kind
from solver.gait.activity_suggestion import suggested_activities
from solver.skeleton.skeleton import Skeleton

ACTIVITY_WORDS = {
    Activity.WALKING: "walk",
    Activity.RUNNING: "run",
    Activity.STAIRS: "stairs",
    Activity.SIT_TO_STAND: "sit-to-stand",
    Activity.JUMP: "jump",
    Activity.SQUAT: "squat",
    Activity.LUNGE: "lunge",
    Activity.STANDING: "standing",
    Activity.TRANSITION: "transition",
}
KIND_WORDS = {
    **{kind: str(kind) for kind in Kind},
    Kind.BOTH_FEET: "double support",
    Kind.ONE_FOOT: "single support",
}


def suggestions_of(trial: TrialFit, skeleton: Skeleton) -> tuple[SuggestedActivity, ...]:
    """What the person seems to do in a trial, for somebody to confirm, change or refuse.

    Args:
        trial: solved.
        skeleton: fitted.
    """
    return tuple(as_suggested(found) for found in suggested_activities(trial, skeleton))


def as_suggested(found: ActivitySuggestion) -> SuggestedActivity:
    """The same in the words of `annotations.activities`.

    Args:
        found: by the solver.
    """
    subclass = None if found.kind is None else KIND_WORDS[found.kind]
    activity = ACTIVITY_WORDS[found.activity]
    return SuggestedActivity(found.start, found.end, activity, subclass, found.confidence, found.by)
