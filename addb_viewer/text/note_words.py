"""Notes by kind, in order of harm: what needs a decision, and what is only good to know."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from solver.common.notes import Kind, Note

MOST_FAR = 8  # names of markers in a line


@dataclass(frozen=True)
class NotesOfKind:
    """All notes of one kind."""

    kind: Kind
    notes: tuple[Note, ...]

    @property
    def needs_decision(self) -> bool:
        """Whether somebody has to choose or look."""
        return self.kind.severity == "decide"

    @property
    def heading(self) -> str:
        """With the number of notes, if there are several."""
        return self.kind.heading + (f" ({len(self.notes)})" if len(self.notes) > 1 else "")

    @property
    def key_findings(self) -> str:
        """One sentence for all of them; markers by name, the farthest first."""
        if self.kind is Kind.FAR_MARKERS:
            return f"{self.heading}: {_farthest(self.notes)}; slipped, swapped or mislabelled?"
        if len(self.notes) == 1:
            return self.notes[0]
        return f"{self.heading}: {self.notes[0]} (the others: --notes)"


def by_kind(notes: Iterable[Note]) -> list[NotesOfKind]:
    """The notes that there are, none twice, the most harmful kind first; in each in the order given."""
    found: dict[Kind, list[Note]] = {kind: [] for kind in Kind}
    for note in dict.fromkeys(notes):
        found[note.kind].append(note)
    return [NotesOfKind(kind, tuple(those)) for kind, those in found.items() if those]


def _farthest(notes: Sequence[Note]) -> str:
    far: dict[str, int] = {}
    for note in notes:
        name, cm = str(note.values["marker"]), int(note.values["cm"])
        far[name] = max(cm, far.get(name, 0))
    ranked = sorted(far, key=lambda name: -far[name])
    more = f" and {len(ranked) - MOST_FAR} more" if len(ranked) > MOST_FAR else ""
    return ", ".join(f"{name} {far[name]} cm" for name in ranked[:MOST_FAR]) + more
