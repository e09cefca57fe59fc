"""What a person flagged, as a solve takes it."""

from solver.contact.force_review import ForceLabel, ForceReview


def flagged(*ranges):
    """A review of these flags alone, each (start, end, foot, reason)."""
    return ForceReview(by_people=tuple(ForceLabel(*missing) for missing in ranges))
