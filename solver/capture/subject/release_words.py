"""The table [release] of a subject.toml: where a subject comes from, and on what terms others may have it."""

import re

from solver.capture.capture import ReleaseWords
from solver.capture.subject.description import Entries
from solver.common.notes import Note

KEYS = ("source", "person", "laboratory", "licence", "consent", "citation", "doi", "url")
CONSENTS = ("public", "restricted", "unknown")
BIBTEX = ".bib"


def release_words(entries: Entries) -> tuple[ReleaseWords | None, tuple[Note, ...]]:
    """What a subject.toml says under [release], and a note about keys that mean nothing there.

    Args:
        entries: the whole file's.

    Raises:
        CaptureError: a value is of the wrong kind, or a BibTeX file is missing or outside the folder.
    """
    table = entries.values.get("release")
    if table is None:
        return None, ()
    if not isinstance(table, dict):
        raise entries.complaint("release", 'it is a table of its own: [release], then source = "…".')
    own = Entries(entries.path, table, "release.")
    doi = _text(own, "doi")
    if doi is not None:
        doi = re.sub(r"^(https?://(dx\.)?doi\.org/|doi:\s*)", "", doi)
        if not re.fullmatch(r"10\.\d{4,9}/\S+", doi):
            raise own.complaint("doi", "no DOI. Write it as 10.1234/abcd.")
    url = _text(own, "url")
    if url is not None and not re.fullmatch(r"https?://\S+", url):
        raise own.complaint("url", "no address of the web. Write it with https:// in front.")
    words = ReleaseWords(
        source=_name(own, "source"),
        person=_name(own, "person"),
        laboratory=_text(own, "laboratory"),
        licence=_text(own, "licence"),
        consent=own.word("consent", CONSENTS),
        citation=_citation(own),
        doi=doi,
        url=url,
    )
    return words, own.unknown(KEYS)


def _text(entries: Entries, key: str) -> str | None:
    value = entries.values.get(key)
    if value is None:
        return None
    if not isinstance(value, str) or not value.strip():
        raise entries.complaint(key, "a text in quotes is needed; leave the key out where it is not known.")
    return value.strip()


def _name(entries: Entries, key: str) -> str | None:
    """A text that becomes a part of identifiers."""
    value = _text(entries, key)
    if value is not None and (re.search(r"[/\\\x00-\x1f]", value) or value.startswith(".")):
        raise entries.complaint(
            key, "it becomes a part of names: leave out / and \\, and begin with another sign than a dot."
        )
    return value


def _citation(entries: Entries) -> str | None:
    value = _text(entries, "citation")
    if value is None or not value.lower().endswith(BIBTEX) or "\n" in value:
        return value
    path = entries.file("citation")
    assert path is not None
    try:
        return path.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise entries.complaint("citation", f"cannot be read as text ({error}).") from error
