"""What was decided on one cause, and at which check it fell.

Takes the plain values of `diagnose --json`.
"""

from collections.abc import Mapping
from typing import Any

from addb_viewer.diagnosis_vocabulary import capital, title
from addb_viewer.sections import Section
from solver.effects.catalogue import MARKER_IDS

IN_MARKERS = "It is sought in the markers, before forces; what was found there stands in the whole answer."
NEVER_PROPOSED = (
    "It was never proposed: at every step of the search others promised more, or this recording has no place "
    "for it, or of the size that would help there is no such thing."
)

Figures = Mapping[str, Any]


def decisions_on(figures: Figures, id: str) -> list[Section]:
    """Of each place at which a cause was tried: what every check said, up to the one at which it fell.

    Args:
        figures: in the shape of `diagnose --json`, made with this id.
        id: of the cause.
    """
    tried = [_told(one) for one in figures.get("decisions", ()) if one["id"] == id]
    return tried or [Section(f"{id}: not tried", (IN_MARKERS if id in MARKER_IDS else NEVER_PROPOSED,))]


def _told(one: Figures) -> Section:
    fell = next((c["name"] for c in one["checks"] if not c["passed"]), None)
    verdict = "named" if one["named"] else f"fell at '{fell}'"
    rows = tuple((c["name"] if c["passed"] else f"{c['name']}, no", c["reason"]) for c in one["checks"])
    return Section(f"{capital(title(one))}: {verdict}", (), rows)
