"""The address of a frame, `/?at=subject/trial/frame`: to be sent to a colleague, and to come back to."""

from dataclasses import dataclass
from urllib.parse import quote, unquote

OPTION = "at"
LONGEST = 2000  # characters of an address; browsers and proxies take that much


@dataclass(frozen=True)
class TrialAddress:
    """A frame of a trial; a folder's name in the subject may hold slashes, a trial's stands escaped."""

    subject: str
    trial: str
    frame: int = 0

    def __str__(self) -> str:
        """What stands in the address behind the server's name."""
        return f"/?{OPTION}={quote(self.subject, safe='/')}/{quote(self.trial, safe='')}/{self.frame}"


def address_in(query: str) -> TrialAddress | None:
    """The one that a query says and nothing else; None where there is none, or anything beside it.

    Args:
        query: as it stands behind the `?`.
    """
    option, _, value = query.partition("=")
    if option != OPTION or "&" in value or len(value) > LONGEST:
        return None
    subject, _, rest = value.rpartition("/")[0].rpartition("/")
    frame = value.rpartition("/")[2]
    if not (subject and rest and frame.isascii() and frame.isdigit() and len(frame) <= 9):
        return None
    try:
        return TrialAddress(unquote(subject, errors="strict"), unquote(rest, errors="strict"), int(frame))
    except UnicodeDecodeError:
        return None


def wished_in(query: str) -> TrialAddress | None:
    """The first one among a query's options, whatever else it says."""
    return next((found for part in query.split("&") if (found := address_in(part)) is not None), None)
