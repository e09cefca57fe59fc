"""What subjects, persons and trials are called in a release, and what names must not tell."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from urllib.parse import quote

_DAY = r"(?:\d{4}[-_./]\d{1,2}[-_./]\d{1,2}|\d{1,2}[-_./]\d{1,2}[-_./]\d{4}|(?:19|20)\d{6})"
_DATE = re.compile(rf"(?<!\d){_DAY}(?:[T ]\d{{2}}:\d{{2}}(?::\d{{2}})?)?(?!\d)")
_PATH = re.compile(r"(?:(?<=\s)|(?<=^)|(?<=['\"(]))(?:[A-Za-z]:)?[/\\](?:[^\s'\":;,()/\\]+[/\\])+")


def file_name_of(identifier: str) -> str:
    """An identifier as file names bear it: `/` is `__`, other signs that they do not bear are %XX."""
    return "__".join(quote(part, safe=" -_.()+") for part in identifier.split("/"))


def without_places(text: str, folders: Iterable[Path]) -> str:
    """A text without dates, without paths, and with what lies in some folders told from there on.

    Args:
        text: as the program says it.
        folders: the inner ones are taken out before those that hold them.
    """
    places = {str(place) for folder in folders for place in (folder, folder.resolve())}
    for place in sorted(places, key=lambda place: (-len(place), place)):
        text = text.replace(place + "/", "").replace(place, "the folder")
    return _DATE.sub("[date]", _PATH.sub("", text))


def without_names(text: str, folder: Path, also: Sequence[str] = ()) -> str:
    """A note without paths, dates, the folder's name and other names.

    Args:
        text: as the fit says it.
        folder: of the subject.
        also: further words to take out.
    """
    text = without_places(text, [folder])
    for word in also:
        if len(word) >= 3:
            text = re.sub(rf"(?<!\w){re.escape(word)}(?!\w)", "[name]", text)
    return text


def labels_without_names(labels: Sequence[str]) -> list[str]:
    """Marker labels without the person's name that some systems put before a colon; none twice."""
    taken: list[str] = []
    for label in labels:
        plain, number = label.rsplit(":", 1)[-1] or label, 1
        while plain in taken:
            number += 1
            plain = f"{label.rsplit(':', 1)[-1]}_{number}"
        taken.append(plain)
    return taken
