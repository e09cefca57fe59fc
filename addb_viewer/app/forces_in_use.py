"""Which forces the solve on the screen counted, and which the next one will."""

from addb_viewer.app.feet import foot_words
from addb_viewer.app.replay import Replay
from addb_viewer.app.stops import Stop
from annotations.trial_review import TrialReview
from solver.contact.wrenches import MissingRange


def contacts_at(replay: Replay, frame: int, foot: str | None) -> list[Stop]:
    """The contacts on a frame, of one foot or, for None, of all."""
    return [
        (phase.start, phase.end, replay.feet[phase.foot])
        for phase in replay.forces.contacts
        if phase.start <= frame < phase.end and foot in (None, replay.feet[phase.foot])
    ]


def contact_words(contacts: list[Stop]) -> str:
    """What keys act on where nothing is selected."""
    if not contacts:
        return "the contact under the cursor (none here)"
    return " and ".join(f"{foot_words(foot)} {start}–{end - 1}" for start, end, foot in contacts)


def left_out(replay: Replay, review: TrialReview) -> tuple[MissingRange, ...]:
    """What the next solve leaves out, as far as people and detection say."""
    if review.decided:
        return review.missing_ranges
    return tuple(m for m in replay.forces.missing if m[2] is None or m[2] in review.feet)


def stale(replay: Replay, review: TrialReview) -> bool:
    """Whether the fit on the screen was made with other flags."""
    if replay.residual is None or not review.decided:
        return False
    used = {(a, b, foot) for a, b, foot, _ in replay.forces.missing}
    wanted = {(a, b, foot) for a, b, foot, _ in review.missing_ranges}
    return replay.forces.source != "review" or not wanted <= used
