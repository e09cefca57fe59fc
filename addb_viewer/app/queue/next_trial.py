"""Which trial of the queue is next for whom."""

from collections.abc import Collection, Sequence

from addb_viewer.app.queue.rows import Row
from addb_viewer.app.subjects.people import TrialPlace


def next_trial(rows: Sequence[Row], here: TrialPlace | None, taken: Collection[TrialPlace]) -> Row | None:
    """The next trial that waits for a person and that nobody else is on; None: there is none.

    Args:
        rows: of the queue, in order.
        here: subject and trial on the screen: those after it come first; None: from the top.
        taken: where others are.
    """
    places = [(row.subject, row.trial) for row in rows]
    after = places.index(here) + 1 if here in places else 0
    waiting = to_review((*rows[after:], *rows[:after]), here)
    return next((row for row in waiting if (row.subject, row.trial) not in taken), None)


def to_review(rows: Sequence[Row], here: TrialPlace | None) -> list[Row]:
    """The trials that are not finished, but for the one on the screen, whoever is on them."""
    return [row for row in rows if not (row.finished or row.error or (row.subject, row.trial) == here)]
