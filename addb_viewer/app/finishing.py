"""T: a trial is finished, after a question where something speaks against it, and the next one opened."""

from typing import TYPE_CHECKING

from annotations.events import Status
from annotations.trial_review import TrialReview

if TYPE_CHECKING:
    from addb_viewer.app.session import Session

MOST = 3  # disagreements in words; the others are counted


def doubts(review: TrialReview) -> list[str]:
    """Why to ask before a trial is finished, a sentence or two each; nothing where nothing speaks against it.

    Args:
        review: of the trial.
    """
    return _disagreements(review)


class Finishing:
    """Finishes trials at one browser."""

    def __init__(self, session: "Session") -> None:
        self.session = session

    def finish(self) -> None:
        """T."""
        session = self.session
        session.author()
        reasons = doubts(session.review.review)
        if reasons:
            session.questions.ask("Finish this trial all the same?", reasons, "Finish", self._finish)
        else:
            self._finish()

    def _finish(self) -> None:
        session, queue, people = self.session, self.session.queue, self.session.house.people
        session.review.set_status(Status.FINISHED)
        session.house.refresh(session.room.name)
        here, row = queue.here, queue.offer()
        if row is None:
            queue.draw()
            self._tell_end()
            return
        session.notices.tell("Finished", f"Next: {row.subject if session.house.several else ''} {row.trial}")
        try:
            session.open(row.subject, row.trial)
        except Exception:
            people.go(session.page, here)
            raise

    def _tell_end(self) -> None:
        taken = self.session.queue.taken()
        if taken:
            self.session.notices.tell(
                "Nothing is left for you", f"Somebody is on what still waits: {'; '.join(taken)}."
            )
        else:
            self.session.notices.tell("All finished", "Every trial of the queue has been reviewed.")


def _disagreements(review: TrialReview) -> list[str]:
    told = [f"Two people disagree about {conflict}." for conflict in review.conflicts[:MOST]]
    more = len(review.conflicts) - MOST
    return [*told, f"They disagree {more} times more."] if more > 0 else told
