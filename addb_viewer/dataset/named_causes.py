"""What the last diagnosis of a subject named, as long as its recordings are the same."""

import hashlib
import json
from typing import Any

from addb_viewer.jobs.kept_diagnosis import kept
from solver.capture.capture import Subject
from solver.fitting.provenance import other_recordings, provenance_of
from solver.fitting.results.store import default_folder


def named_causes(subject: Subject) -> list[dict[str, Any]]:
    """The effects, as `diagnose --json` has them; none where nobody has asked, or files have changed since.

    Raises:
        ResultsError: the kept diagnosis cannot be read.
    """
    found = kept(default_folder(subject.folder))
    if found is None:
        return []
    figures, made_from = found
    if other_recordings(made_from["provenance"], provenance_of(subject, subject.trials)):
        return []
    return list(figures["effects"])


def fingerprint(causes: list[dict[str, Any]]) -> str:
    """SHA-256 of what they say."""
    return hashlib.sha256(json.dumps(causes, sort_keys=True).encode()).hexdigest()
