"""Which edits count after all undoing and redoing, and what a reviewer's next undo or redo is about."""

from collections.abc import Sequence

from annotations.errors import ReviewError
from annotations.events import IMPORTED, Edit, Redo, Undo


def in_force(edits: Sequence[Edit]) -> tuple[Edit, ...]:
    """The edits that count, in order, without the undoing and redoing itself."""
    undone: set[int] = set()
    for edit in edits:
        if isinstance(edit.event, Undo):
            undone.add(edit.event.edit)
        elif isinstance(edit.event, Redo):
            undone.discard(edit.event.edit)
    return tuple(e for e in edits if not isinstance(e.event, Undo | Redo) and e.number not in undone)


def next_undo(edits: Sequence[Edit], author: str) -> Edit:
    """The author's last edit that counts.

    Args:
        edits: of one trial, in order.
        author: whose.

    Raises:
        ReviewError: there is none.
    """
    own = [edit for edit in in_force(edits) if edit.author == author]
    if not own:
        raise ReviewError(f"nothing of {author}'s to undo")
    return own[-1]


def next_redo(edits: Sequence[Edit], author: str) -> Edit:
    """The edit that the author undid last; a new edit leaves nothing to redo.

    Raises:
        ReviewError: there is none.
    """
    undone: list[int] = []
    for edit in edits:
        if edit.author != author:
            continue
        if isinstance(edit.event, Undo):
            undone.append(edit.event.edit)
        elif isinstance(edit.event, Redo):
            undone.remove(edit.event.edit)
        else:
            undone.clear()
    if not undone:
        raise ReviewError(f"nothing of {author}'s to redo")
    return next(edit for edit in edits if edit.number == undone[-1])


def undo_of(edits: Sequence[Edit], number: int, author: str) -> Edit:
    """The edit of that number, where the author may undo it: an own one, or an import.

    Another person's edit is overruled by flagging or clearing its frames: both opinions stay on record.

    Raises:
        ReviewError: there is no such edit, it does not count any more, or it is another person's.
    """
    found = next((edit for edit in in_force(edits) if edit.number == number), None)
    if found is None:
        known = any(edit.number == number for edit in edits)
        reason = "is undone already, or is itself an undo or redo" if known else "is not one of this trial's"
        raise ReviewError(f"edit {number} {reason}")
    if found.author not in (author, IMPORTED):
        raise ReviewError(
            f"edit {number} is {found.author}'s, not {author}'s; flag or clear its frames instead, "
            "then both opinions stay on record"
        )
    return found
