import pytest

from annotations.activities import ACTIVITIES, ERRONEOUS, checked_activity
from annotations.review_errors import ReviewError


def test_the_classes_of_the_paper_are_there():
    named = {" ".join(filter(None, (a, s))) for a, kinds in ACTIVITIES.items() for s in (None, *kinds)}
    assert {
        "walk overground", "walk treadmill", "walk incline", "run overground", "run treadmill", "stairs up",
        "stairs down", "sit-to-stand", "jump", "jump drop jump", "jump squat jump", "jump box jump", "squat",
        "lunge", "standing", "standing single support", "transition start", "transition end", "other",
        ERRONEOUS,
    } <= named  # fmt: skip


@pytest.mark.parametrize(
    ("activity", "subclass", "said"),
    [
        ("walking", None, "no activity 'walking'; nearest: walk"),
        ("run", "incline", "'run' has no subclass 'incline'; it has: overground, treadmill"),
        ("squat", "deep", "'squat' has no subclass 'deep'; it has: none"),
    ],
)
def test_what_the_list_does_not_have_is_refused(activity, subclass, said):
    with pytest.raises(ReviewError, match=said):
        checked_activity(activity, subclass)
