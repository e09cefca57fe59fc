"""Who a subject is in a release, on what terms others may have it, and what a release is built with."""

import hashlib
from dataclasses import dataclass, field

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from addb_viewer.dataset.grid import RELEASE_RATE_HZ
from solver.capture.capture import ReleaseWords, Subject

OLDEST_YEARS = 90.0  # told of everybody above 89: few are, so that a number would name them


@dataclass(frozen=True)
class Terms:
    """What the command line says where a subject.toml is silent."""

    source: str | None = None
    licence: str | None = None
    consent: str | None = None


@dataclass(frozen=True)
class ReleaseSubject:
    """One subject's identity and terms, as its tables have them."""

    source: str
    person: str
    folder: str
    laboratory: str | None
    licence: str | None
    consent: str
    citation: str | None
    url: str | None
    filled: tuple[str, ...]  # keys that the command line filled in

    @property
    def subject_id(self) -> str:
        """SOURCE/FOLDER."""
        return f"{self.source}/{self.folder}"

    @property
    def person_id(self) -> str:
        """SOURCE/PERSON."""
        return f"{self.source}/{self.person}"

    def trial_id(self, name: str) -> str:
        """SOURCE/FOLDER/TRIAL."""
        return f"{self.subject_id}/{name}"


NO_SPDX = (
    "'{}' is no SPDX licence identifier (CC-BY-4.0, CC0-1.0 …; spdx.org/licenses lists them). A licence of "
    "your own is LicenseRef-NAME"
)


def is_spdx(licence: str) -> bool:
    """Whether a text is an SPDX expression: identifiers of their list, or LicenseRef-NAME."""
    try:
        canonicalize_license_expression(licence)
    except InvalidLicenseExpression:
        return False
    return True


def release_subject(subject: Subject, terms: Terms, root: str) -> ReleaseSubject:
    """A subject as the release calls it.

    Args:
        subject: the opened folder.
        terms: for what it does not say.
        root: name of the folder that it was found in: its source where nobody says any.
    """
    words = subject.release or ReleaseWords()
    given = {key: getattr(terms, key) for key in ("source", "licence", "consent")}
    filled = tuple(key for key, value in given.items() if value and getattr(words, key) is None)
    doi = None if words.doi is None else f"https://doi.org/{words.doi}"
    return ReleaseSubject(
        source=words.source or terms.source or root,
        person=words.person or subject.name,
        folder=subject.name,
        laboratory=words.laboratory,
        licence=words.licence or terms.licence,
        consent=words.consent or terms.consent or "unknown",
        citation=words.citation,
        url=words.url or doi,
        filled=filled,
    )


def age_told(age_years: float | None) -> float | None:
    """Age as a release tells it [years]."""
    return OLDEST_YEARS if age_years is not None and age_years > OLDEST_YEARS - 1 else age_years


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


def hash_of_person(person_id: str) -> str:
    """SHA-256 of SOURCE/PERSON."""
    return hashlib.sha256(person_id.encode()).hexdigest()
