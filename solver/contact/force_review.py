"""What people, and the files that they brought, say about a trial's forces: plain ranges of frames."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from solver.contact.wrenches import MissingRange


class ForceLabel(NamedTuple):
    """One thing said of frames start to end − 1."""

    start: int
    end: int
    foot: str | None  # None for all feet
    reason: str | None  # why the force does not count; None: it counts


@dataclass(frozen=True)
class ForceReview:
    """What is said about a trial's forces. Of frames that no label is about, nobody has said anything.

    Of two labels of the same frames and foot the later one holds.
    """

    by_people: tuple[ForceLabel, ...] = ()
    by_file: tuple[ForceLabel, ...] | None = None  # of an imported review; None: the recording's own, if any
    stays_out: tuple[MissingRange, ...] | None = None
    """Of a finished review: what detection left out and nobody decided. None: detection is still asked."""


def as_plain(review: ForceReview) -> dict[str, Any]:
    """A review as JSON has it."""
    return asdict(review)


def from_plain(plain: Mapping[str, Any]) -> ForceReview:
    """The review that `as_plain` was given, by way of JSON.

    Raises:
        KeyError, TypeError, ValueError: it is none.
    """
    by_file, stays_out = plain["by_file"], plain["stays_out"]
    return ForceReview(
        by_people=_labels(plain["by_people"]),
        by_file=None if by_file is None else _labels(by_file),
        stays_out=None
        if stays_out is None
        else tuple((int(a), int(b), f, str(why)) for a, b, f, why in stays_out),
    )


def _labels(plain: list[list[Any]]) -> tuple[ForceLabel, ...]:
    return tuple(ForceLabel(int(start), int(end), foot, reason) for start, end, foot, reason in plain)
