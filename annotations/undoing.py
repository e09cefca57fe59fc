"""Which edits count after all undoing and redoing, and what a reviewer's next undo or redo is about."""

from collections.abc import Sequence

from annotations.events import IMPORTED, Edit, Redo, Undo
from annotations.reading import UnreadableRow
from annotations.review_errors import ReviewError


def in_force(edits: Sequence[Edit]) -> tuple[Edit, ...]:
    """The edits that count, in order, without the undoing and redoing itself."""
    undone = _undone(edits)
    return tuple(e for e in edits if not isinstance(e.event, Undo | Redo) and e.number not in undone)


def next_undo(edits: Sequence[Edit], author: str, unreadable: Sequence[UnreadableRow] = ()) -> Edit:
    """The author's last edit that counts.

    Args:
        edits: of one trial, in order.
        author: whose.
        unreadable: rows of the trial that cannot be read. What came before such a row of the author's is not
            gone back to: nobody knows whether the row was about it.

    Raises:
        ReviewError: there is none.
    """
    own = [edit for edit in in_force(edits) if edit.author == author]
    last = own[-1].number if own else 0
    for row in reversed(unreadable):
        if row.may_be_of(author) and row.number > last and row.number not in _undone(edits):
            raise ReviewError(
                f"{row.name} cannot be read, so undo does not go back beyond it ({row.why}); flag or clear "
                "the frames instead"
            )
    if not own:
        raise ReviewError(f"nothing of {author}'s to undo")
    return own[-1]


def next_redo(edits: Sequence[Edit], author: str, unreadable: Sequence[UnreadableRow] = ()) -> Edit:
    """The edit that the author undid last; a new edit leaves nothing to redo.

    Args:
        edits: of one trial, in order.
        author: whose.
        unreadable: rows of the trial that cannot be read. Such a row of the author's may have been a new
            edit: what was undone before it is not redone, and neither is the row itself.

    Raises:
        ReviewError: there is none.
    """
    undone: list[int] = []
    unread = {row.number: row for row in unreadable if row.may_be_of(author)}
    said = {edit.number: edit for edit in edits if edit.author == author}
    passed: UnreadableRow | None = None
    for number in sorted(unread.keys() | said.keys()):
        match said[number].event if number in said else None:
            case None:
                passed, undone = unread[number], []
            case Undo(other):
                undone.append(other)
            case Redo(other):
                undone = [one for one in undone if one != other]
            case _:
                passed, undone = None, []
    found = next((edit for edit in edits if undone and edit.number == undone[-1]), None)
    if found is None and (passed is not None or undone):
        row = passed or next((row for row in unreadable if row.number == undone[-1]), None)
        if row is not None:
            raise ReviewError(
                f"{row.name} cannot be read, so neither it nor anything before it can be redone ({row.why}); "
                "flag or clear the frames instead"
            )
    if found is None:
        raise ReviewError(f"nothing of {author}'s to redo")
    return found


def undo_of(
    edits: Sequence[Edit], number: int, author: str, unreadable: Sequence[UnreadableRow] = ()
) -> Edit:
    """The edit of that number, where the author may undo it: an own one, or an import.

    Another person's edit is overruled by flagging or clearing its frames: both opinions stay on record.

    Args:
        edits: of one trial, in order.
        number: of the edit.
        author: who undoes it.
        unreadable: rows of the trial that cannot be read.

    Raises:
        ReviewError: there is no such edit, it does not count any more, it cannot be read, or it is another
            person's.
    """
    found = next((edit for edit in in_force(edits) if edit.number == number), None)
    if found is None:
        row = next((row for row in unreadable if row.number == number), None)
        if row is not None:
            raise ReviewError(
                f"{row.name} cannot be read ({row.why}): it does not count, and cannot be undone"
            )
        known = any(edit.number == number for edit in edits)
        reason = "is undone already, or is itself an undo or redo" if known else "is not one of this trial's"
        raise ReviewError(f"edit {number} {reason}")
    if found.author not in (author, IMPORTED):
        raise ReviewError(
            f"edit {number} is {found.author}'s, not {author}'s; flag or clear its frames instead, "
            "then both opinions stay on record"
        )
    return found


def _undone(edits: Sequence[Edit]) -> set[int]:
    undone: set[int] = set()
    for edit in edits:
        if isinstance(edit.event, Undo):
            undone.add(edit.event.edit)
        elif isinstance(edit.event, Redo):
            undone.discard(edit.event.edit)
    return undone
