"""Edits of a log whose file is gone, put into a new file beside it."""

from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from annotations.errors import ReviewError
from annotations.events import Edit
from annotations.log import ReviewLog
from annotations.unreadable import UnreadableRow, listed


def rescued(
    file: Path,
    loss: str,
    known: Sequence[Edit],
    asked: Sequence[Edit],
    unreadable: Sequence[UnreadableRow] = (),
) -> str:
    """Write edits into a file that is not there yet, whole and ready to take the lost one's place.

    Args:
        file: that is lost.
        loss: what happened to it, as a clause.
        known: all edits of its subject that are known.
        asked: the one that was to be recorded, if any.
        unreadable: rows of the lost file that nobody could read; they are named.

    Returns:
        Words for people: what happened, where the edits are, what to do.

    Raises:
        ReviewError: they cannot be written; they are in memory alone.
    """
    now = datetime.now(UTC)
    place = file.with_name(f"{file.stem}.rescued-{now:%Y-%m-%dT%H-%M-%S.%f}Z{file.suffix}")
    try:
        with ReviewLog.open(place) as log:
            log.take_over((*known, *asked))
    except ReviewError as error:
        for left in ("", "-wal", "-shm"):
            with suppress(OSError):
                place.with_name(f"{place.name}{left}").unlink()
        raise ReviewError(
            f"{file}: {loss}. Nothing is recorded now. The {len(known)} edits so far are only in memory, "
            f"because they cannot be written beside it ({error}). Leave the app open, make room there or "
            "make the folder writable again, and repeat the edit"
        ) from error
    with_it = ", with the one that was being made," if asked else ""
    without = f" Not in it, because they cannot be read: {listed(unreadable)}." if unreadable else ""
    return (
        f"{file}: {loss}. Nothing is recorded any more. All {len(known) + len(asked)} edits that were known "
        f"here{with_it} are in {place.name} beside it.{without} Close the app; then put the right file in "
        f"place, or rename {place.name} to {file.name}, remove {file.name}-wal and {file.name}-shm if they "
        "are there, and open the subject again"
    )
