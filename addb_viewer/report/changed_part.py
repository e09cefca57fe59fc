"""What the fit to forces changed in the motion, by coordinate and frequency band."""

from collections.abc import Mapping, Sequence
from typing import Any

from addb_viewer.change_words import (
    READING,
    ChangeRow,
    bands_in_words,
    change_rows,
    change_sentence,
    limit_in_words,
)
from addb_viewer.report.markup import Safe, element, joined, table


def changed_part(trials: Sequence[Mapping[str, Any]]) -> Safe:
    """A sentence a trial, and its table one click away; empty where no trial was fitted to forces.

    Args:
        trials: in the shape of `fit --json`.
    """
    pieces = []
    for figures in trials:
        change = figures.get("change")
        if change is None or not change_sentence(change):
            continue
        name = f"{figures['name']}: " if len(trials) > 1 else ""
        pieces.append(element("p", f"{name}{change_sentence(change)}."))
        told = (
            "Root mean squares; the constant part and the bands add up as squares. Small: gain and phase "
            "against the markers' motion, where that has 0.2° or 1 mm there; a positive phase is early. "
            f"Range and peak speed of the fit; in brackets against {limit_in_words(change)}: more than that "
            "is faster movement that the fit keeps. Both leave out 0.1 s at the ends."
        )
        pieces.append(
            element(
                "details",
                element("summary", "By coordinate and frequency"),
                element("p", told, class_="fine"),
                _table(change),
            )
        )
    if not pieces:
        return Safe("")
    heading = element("h3", "What the fit to forces changed in the motion")
    return joined((heading, element("p", READING), *pieces))


def _table(change: Mapping[str, Any]) -> Safe:
    head = ("Coordinate", "RMS", "constant", *bands_in_words(change), "Range", "Peak speed")
    return table(head, [_cells(row) for row in change_rows(change)], "changed")


def _cells(row: ChangeRow) -> list[str]:
    bands = [
        joined((rms, element("small", gain))) if gain else rms
        for rms, gain in zip(row.bands, row.gains, strict=True)
    ]
    return [row.coordinate, row.rms, row.offset, *bands, row.range, row.peak_speed]
