"""What somebody decided about the causes of a diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from addb_viewer.text.extension_words import what_accepting_changes
from addb_viewer.text.sections import as_text
from solver.common.typed_json import plain
from solver.diagnosis.diagnosis_report import AcceptedGain


@dataclass(frozen=True, eq=False, repr=False)
class Acceptance:
    """Causes that later fits use beside the recorded forces, and what they change."""

    by: str
    sentence: str  # what was accepted
    gain: AcceptedGain
    left_out: tuple[str, ...]  # causes that lie in the markers alone
    file: Path | None  # that keeps the figures; None where only labels are exchanged

    @property
    def figures(self) -> Mapping[str, Any]:
        """What accepting changes, in the shape of `addb-viewer accept --json`."""
        return plain(self.gain)

    def __repr__(self) -> str:
        """What was accepted, in a line."""
        return f"<Acceptance by {self.by}: {self.sentence}>"

    def __str__(self) -> str:
        """What accepting changes: held-out forces, markers, mass, torques."""
        if self.file is None:
            return self.sentence
        return "\n".join(as_text([what_accepting_changes(self.gain)]))
