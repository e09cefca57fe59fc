"""Who a subject is in a release, and on what terms others may have it."""

from dataclasses import dataclass

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

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
