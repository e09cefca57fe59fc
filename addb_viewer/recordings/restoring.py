"""The review log that an MCAP file holds, put back into a subject's store."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from addb_viewer.recordings.mcap_recording import ABOUT, EDITS_TOPIC
from addb_viewer.recordings.mcap_recovery import Found, readable
from annotations.errors import ReviewError
from annotations.event_codec import decoded, encoded
from annotations.events import Edit, Event, ImportLabels, Redo, Undo
from annotations.log import ReviewLog
from annotations.reading import check_author, date_of
from annotations.unreadable import is_text
from solver.common.errors import ResultsError
from solver.common.small_files import json_of


@dataclass(frozen=True)
class Restored:
    """What became of a file's edits."""

    added: int
    there: int  # the store has them already
    with_dates: bool  # False: edits were added to others, under the date of now


def edits_in(file: Path) -> tuple[Edit, ...]:
    """The review log in an MCAP file, cut or not, by number; each edit once.

    Raises:
        ResultsError: no MCAP file, or an edit in it is none.
        ReviewError: an edit of a newer version.
    """
    edits: dict[int, Edit] = {}
    for part in readable(file, Found()):
        if part.message is None or part.channel is None or part.channel.topic != EDITS_TOPIC:
            continue
        try:
            edit = _edit(json_of(part.message.data.decode()))
        except (ValueError, KeyError, TypeError) as error:
            raise ResultsError(f"{file}: {EDITS_TOPIC}: not an edit of a review ({error})") from error
        except ReviewError as error:
            raise ReviewError(f"{file}: {EDITS_TOPIC}: an edit cannot be read: {error}") from error
        edits[edit.number] = edit
    return tuple(edits[number] for number in sorted(edits))


def check_identity(file: Path, edits: Sequence[Edit], subject: str, frames: Mapping[str, int]) -> None:
    """Refuse edits of another subject, or of another recording under a trial's name.

    Args:
        file: of the session or recording that holds them.
        edits: to be restored.
        subject: name of who gets them.
        frames: how many each of its trials has, of those whose files can be read.

    Raises:
        ResultsError: they are another's.
    """
    about = (part.metadata for part in readable(file, Found()) if part.metadata is not None)
    whose = next((each.metadata.get("subject") for each in about if each.name == ABOUT), None)
    if whose not in (None, subject):
        raise ResultsError(
            f"{file}: its edits are of the subject '{whose}', and this one is '{subject}'. Give that one's "
            "folder; one that was renamed needs its old name as long as you restore."
        )
    for edit in edits:
        has, event = frames.get(edit.trial), edit.event
        of = event.frames if isinstance(event, ImportLabels) else getattr(event, "end", 0)
        if has is not None and (of > has or (isinstance(event, ImportLabels) and of != has)):
            raise ResultsError(
                f"{file}: edit {edit.number} is about {of} frames of {edit.trial}, which has {has} here: "
                "another recording of that name? Nothing was restored."
            )


def _edit(told: Any) -> Edit:
    number, texts = told["number"], (told["trial"], told["author"], told["made_at"], told["kind"])
    if not isinstance(number, int) or not all(is_text(text) for text in texts):
        raise ReviewError("its number, trial, author, date or kind is of a wrong type")
    trial, author, made_at, kind = texts
    event = decoded(kind, told["content"])
    check_author(event, author)
    return Edit(number, trial, author, date_of(made_at), event)


def restore(edits: Sequence[Edit], log: ReviewLog) -> Restored:
    """Put edits into a log, those that it lacks; a second time changes nothing.

    An empty log gets them with authors and dates. One with edits of its own gets the missing ones behind
    these, with their authors; an edit that it has once is held for the one that the file has once.

    Args:
        edits: in the order in which they were made.
        log: the subject's.

    Raises:
        ReviewError: an edit cannot be recorded; the ones before it stay.
    """
    held = log.reading()
    own = held.edits
    if not own and not held.unreadable:
        return Restored(log.take_over(edits), 0, with_dates=True)
    unmatched: dict[str, list[int]] = {}
    for edit in own:
        unmatched.setdefault(_key(edit.trial, edit.author, edit.event), []).append(edit.number)
    number: dict[int, int] = {}
    added = 0
    for edit in edits:
        event = _renumbered(edit.event, number)
        same = unmatched.get(_key(edit.trial, edit.author, event))
        if same:
            number[edit.number] = same.pop(0)
            continue
        number[edit.number] = log.append(edit.trial, event, edit.author)
        added += 1
    return Restored(added, len(edits) - added, with_dates=False)


def _renumbered(event: Event, number: dict[int, int]) -> Event:
    """An undo or redo speaks of the edit by its number in the other log."""
    if not isinstance(event, Undo | Redo):
        return event
    if event.edit not in number:
        raise ReviewError(f"the file undoes edit {event.edit}, which it does not hold; nothing more is taken")
    return replace(event, edit=number[event.edit])


def _key(trial: str, author: str, event: Event) -> str:
    return json.dumps([trial, author, *encoded(event)], sort_keys=True, default=str)
