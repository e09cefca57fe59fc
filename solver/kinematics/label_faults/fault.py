"""One fault of labels, and what was done about it."""

from collections.abc import Sequence
from dataclasses import dataclass

from solver.common.notes import Kind, Note

EXCHANGED, MASKED = "exchanged", "masked"


@dataclass(frozen=True)
class LabelFault:
    """A label on the wrong trajectory for a while."""

    labels: tuple[str, ...]  # two that were exchanged back, or one that was masked; as recorded
    start: int  # first frame
    end: int  # first frame that no longer belongs
    done: str  # EXCHANGED or MASKED
    frames: int  # on which a label of these was seen, and so moved or taken out
    off_m: float | None = None  # distances to the neighbours against the usual ones, as recorded, median RMS
    repaired_off_m: float | None = None  # once exchanged back
    neighbours: int = 0  # whose distances tell
    onto: str | None = None  # the label on whose trajectory a masked one lay
    accepted: bool = False  # by a person, from a diagnosis; not by the distances

    @property
    def note(self) -> Note:
        """For people; frames include the last."""
        where = f"frames {self.start}-{self.end - 1}"
        if self.accepted:
            names = " and ".join(self.labels)
            return Note(
                Kind.WRONG_LABELS,
                f"labels {names} swapped back in {where}, as found by a diagnosis and accepted",
            )
        off, told = 100 * (self.off_m or 0.0), f"distances to {self.neighbours} markers near"
        if self.done == EXCHANGED:
            after = 100 * (self.repaired_off_m or 0.0)
            names = " and ".join(self.labels)
            return Note(
                Kind.WRONG_LABELS,
                f"labels {names} were swapped in {where} and are swapped back: {told} them were "
                f"{off:.1f} cm off, and are {after:.1f} cm off now",
            )
        lay = f"on the trajectory of {self.onto}" if self.onto else "off its segment"
        return Note(
            Kind.WRONG_LABELS,
            f"label {self.labels[0]} lay {lay} in {where} and is left out there ({self.frames} frames): "
            f"{told} it were {off:.1f} cm off",
        )


@dataclass(frozen=True)
class Exchange:
    """Two labels that a person says are exchanged on some frames."""

    trial: str
    labels: tuple[str, str]
    start: int
    end: int


def notes_of(faults: Sequence[LabelFault]) -> tuple[Note, ...]:
    """A note on each, in the order of time."""
    return tuple(fault.note for fault in sorted(faults, key=lambda f: (f.start, f.labels)))
