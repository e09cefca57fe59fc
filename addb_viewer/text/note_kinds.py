"""Notes of a fit by kind, in order of harm: what needs a decision, and what is only good to know.

A note belongs to the first kind of which it holds a phrase. One that holds none may be anything, so it is not
hidden: it counts among those that need a decision.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

_FAR = re.compile(r"marker (?P<name>.+) is up to (?P<cm>\d+) cm off")


@dataclass(frozen=True)
class NoteKind:
    """What notes have in common."""

    heading: str
    phrases: tuple[str, ...]  # one of which stands in each
    decide: bool  # whether somebody has to choose or look


@dataclass(frozen=True)
class NotesOfKind:
    """All notes of one kind."""

    kind: NoteKind
    notes: tuple[str, ...]

    @property
    def heading(self) -> str:
        """With the number of notes, if there are several."""
        return self.kind.heading + (f" ({len(self.notes)})" if len(self.notes) > 1 else "")

    @property
    def key_findings(self) -> str:
        """One sentence for all of them; markers by name, the farthest first."""
        if self.kind is FAR_MARKERS:
            return f"{self.heading}: {_farthest(self.notes)}; slipped, swapped or mislabelled?"
        if len(self.notes) == 1:
            return self.notes[0]
        return f"{self.heading}: {self.notes[0]} (the others: --notes)"


FAR_MARKERS = NoteKind("markers far from the model", ("slipped, swapped or mislabelled?",), True)
PELVIS = NoteKind("the pelvis", ("no marker at the ",), True)
MOST_FAR = 8  # names of markers in a line
OTHER = NoteKind("other notes", (), True)

KINDS = (
    NoteKind("several people", ("people in one file: ", "these trials seem to be of "), True),
    NoteKind(
        "not read",
        (
            "cannot be used",
            "cannot be read",
            "no forces of ",
            "forces inside it, if any, are not used",
            " is left out: ",
            "trials without a frame are left out",
            "is the file cut off?",
        ),
        True,
    ),
    NoteKind(
        "forces against the body",
        (
            "the forces ask for a body of ",
            "is not used for the body's mass",
            "plates read ",
            "the forces lean ",
            "its readings contradict that",
            "the largest force is ",
            "do both share one clock?",
            "no centre of pressure on ",
            "no foot of ",
        ),
        True,
    ),
    NoteKind(
        "a guess",
        (
            "is ambiguous",
            "unknown POINT:UNITS",
            "no forces to estimate it from",
            "the recorded forces do not tell it",
        ),
        True,
    ),
    NoteKind(
        "model against markers",
        (
            "seems to be a scaled model",
            "people walk with",
            "would fit better with other segment masses",
            "are placed again",
            "is unusual",
            "from its usual place on the model",
            "contradict the distances",
                        "names no model",
        ),
        True,
    ),
    PELVIS,
    FAR_MARKERS,
    NoteKind(
        "labels on the wrong marker",
        ("were swapped in ", "swapped back in ", " is left out there ("),
        True,
    ),
    NoteKind(
        "labels not used",
        (
            "labels not understood",
            "labels that no recording has",
            "that match no marker of the model, left out",
        ),
        True,
    ),
    NoteKind(
        "reviews",
        (
            "' (edit ",
            "has edits of trials",
            "perhaps nobody has finished the review",
            "frames have no review",
            "is not used, because these have changed",
            "not extended, because",
            "no trial is called",
        ),
        True,
    ),
    NoteKind("the solve", ("did not settle in ", "none predicted", "no measured force is used: "), True),
    NoteKind("out of view", ("no pose on ", "no angle of "), True),
    NoteKind("drawing", ("are not drawn", "No bone mesh for ", "Drawn as rods: "), False),
    NoteKind("labels", (
        "labels understood by the atlas",
        "labels that the marker map explains",
        "points that software computed",
        "labels that no table has",
        "labels without a meaning, ",
        "labels that the model has no markers for",
        "matched by similar names",
        "under other names",
        "does not know, left out",
        "pieces of one trajectory",
        "is removed from the labels",
        "unlabelled trajectories are left out",
        "computed quantities, not markers",
    ), False),
    NoteKind("bodies without markers", (
        "how they move is a guess",
        "and have no angles",
        "their pose is interpolated",
        "they are used as they are",
        "the shoulder rose?",
    ), False),
    NoteKind("axes, units and plates", (
        " points up",
        "moment columns read as",
        "FORCE_PLATFORM:",
        "taken off as its zero level",
        "while nobody is on it; ",
        "hold forces of others once more",
        "low-passed at ",
        "was not tared",
        "centres of pressure read as",
        "its free moment is taken as zero",
        "taken as the free moment",
        "belong to no force plate",
        "as subject.toml says",
    ), False),
    NoteKind("the person", (
        "mass not given",
        "height not given",
        "sex not given",
        "own scaled model",
        ": stated in ",
        "trials of one person",
        "so it is the static trial",
    ), False),
    NoteKind("frames and values left out", (
        "are not used: outside",
        "not observed",
        "counts as not seen",
        "never seen",
        "are blank or NaN",
        "the file holds ",
        "left out, the trial is read from",
        "Not used: ",
    ), False),
)  # fmt: skip


def by_kind(notes: Iterable[str]) -> list[NotesOfKind]:
    """The notes that there are, the most harmful kind first; in each in the order given."""
    found: dict[NoteKind, list[str]] = {kind: [] for kind in _in_order()}
    for note in dict.fromkeys(notes):
        found[_kind_of(note)].append(note)
    return [NotesOfKind(kind, tuple(those)) for kind, those in found.items() if those]


def _in_order() -> list[NoteKind]:
    harmful = [kind for kind in KINDS if kind.decide]
    return [*harmful, OTHER, *(kind for kind in KINDS if not kind.decide)]


def _kind_of(note: str) -> NoteKind:
    return next((kind for kind in KINDS if any(phrase in note for phrase in kind.phrases)), OTHER)


def _farthest(notes: Sequence[str]) -> str:
    far: dict[str, int] = {}
    for note in notes:
        match = _FAR.search(note)
        if match:
            far[match["name"]] = max(int(match["cm"]), far.get(match["name"], 0))
    ranked = sorted(far, key=lambda name: -far[name])
    more = f" and {len(ranked) - MOST_FAR} more" if len(ranked) > MOST_FAR else ""
    return ", ".join(f"{name} {far[name]} cm" for name in ranked[:MOST_FAR]) + more
