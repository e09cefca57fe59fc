"""Other flags than the present ones, to ask the solver about."""

from collections.abc import Sequence

from addb_viewer.app.feet import foot_words
from annotations.reasons import MANUAL_REVIEW
from solver.contact.wrenches import MissingRange


def flipped(
    present: Sequence[MissingRange], chosen: tuple[int, int], foot: str | None, feet: Sequence[str]
) -> tuple[list[MissingRange], str]:
    """Other flags than the present ones on a range: what is mostly left out counts, and the other way round.

    Args:
        present: flags.
        chosen: the range.
        foot: that it is about; None for all.
        feet: of the subject.

    Returns:
        The flags, and in words what is asked.
    """
    start, end = chosen
    about = list(feet) if foot is None else [foot]
    out = {(frame, f) for a, b, of, _ in present for frame in range(max(a, start), min(b, end)) for f in about
           if of in (None, f)}  # fmt: skip
    where = f"frames {start} to {end - 1}, {foot_words(foot)}"
    if 2 * len(out) < (end - start) * len(about):
        return [*present, (start, end, foot, MANUAL_REVIEW)], f"If {where}, did not count"
    kept: list[MissingRange] = []
    for a, b, of, why in present:
        for f in feet if of is None else [of]:
            if f not in about:
                kept.append((a, b, f, why))
                continue
            kept += [(x, y, f, why) for x, y in ((a, min(b, start)), (max(a, end), b)) if x < y]
    return kept, f"If {where}, counted"
