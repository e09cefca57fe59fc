"""What a release is built with."""

from dataclasses import asdict, dataclass, field
from typing import Any

from addb_viewer.dataset.grid import RELEASE_RATE_HZ
from addb_viewer.dataset.release_subject import Terms


@dataclass(frozen=True)
class BuildOptions:
    """All that changes what is in a release, beside its subjects."""

    terms: Terms = field(default_factory=Terms)
    unreviewed: bool = False  # keep trials whose review nobody has finished
    rate_hz: float | None = RELEASE_RATE_HZ  # None: each recording's own
    without: tuple[str, ...] = ()  # persons who are left out: SOURCE/PERSON
    names: bool = False  # reviewers are told by their own names

    def as_plain(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self)


def options_from(plain: dict[str, Any]) -> BuildOptions:
    """The options that `as_plain` was asked of."""
    return BuildOptions(
        Terms(**plain["terms"]),
        plain["unreviewed"],
        plain["rate_hz"],
        tuple(plain["without"]),
        plain["names"],
    )
