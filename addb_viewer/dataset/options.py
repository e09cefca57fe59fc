"""What a release is built with."""

import hashlib
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
    b3d: bool = True  # write a B3D file a subject
    withdrawn: tuple[str, ...] = ()  # hashes of those who were left out of an earlier build

    @property
    def withdrawals(self) -> tuple[str, ...]:
        """Hashes of all who ever withdrew: what stays with a release, and names nobody."""
        return tuple(sorted({*self.withdrawn, *map(hash_of_person, self.without)}))

    def leaves_out(self, person_id: str) -> bool:
        """Whether the person withdrew, now or before an earlier build."""
        return person_id in self.without or hash_of_person(person_id) in self.withdrawn

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
        plain["b3d"],
        tuple(plain["withdrawn"]),
    )


def hash_of_person(person_id: str) -> str:
    """SHA-256 of SOURCE/PERSON."""
    return hashlib.sha256(person_id.encode()).hexdigest()
