"""The figures of two fits' agreement as lines of a table."""

from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.fit_agreement import Agreement, rms
from benchmarks.leg_joints import JOINTS

HEADER = (
    "hip° knee° ankle° (offset off)  by landmarks   hip knee ankle cm   "
    "off the turning point (the model's own fit) hip knee ankle cm"
)


def figures(found: Agreement) -> str:
    """Markers used, their RMS [cm], and how far the fits lie apart."""
    return f"{found.markers_used:3d}   {100 * found.marker_rms_m:5.2f}  {apart(found)}"


def apart(found: Agreement) -> str:
    """Angles [°], also without each side's offset and by landmarks; centres and off turning points [cm]."""
    free = " ".join(f"{found.angle_rms_without_offset_deg[a]:4.1f}" for a in JOINTS)
    return (
        f"{_row(found.angle_rms_deg[a] for a in JOINTS)}  ({free})  "
        f"{_row(found.anatomical_rms_deg[a] for a in JOINTS)}   "
        f"{_row(100 * found.centre_rms_m[j] for j in JOINTS)}   "
        f"{'  '.join(_pair(found.off_turning_point_m[j]) for j in JOINTS)}"
    )


def together(found: Sequence[Agreement]) -> str:
    """RMS over recordings of each figure, where it is known."""
    angles = _row(_pooled([f.angle_rms_deg[a] for f in found]) for a in JOINTS)
    marked = _row(_pooled([f.anatomical_rms_deg[a] for f in found]) for a in JOINTS)
    centres = _row(_pooled([100 * f.centre_rms_m[j] for f in found]) for j in JOINTS)
    off = "  ".join(_pair(_pooled_pair([f.off_turning_point_m[j] for f in found])) for j in JOINTS)
    return f"RMS over recordings: angles {angles}; by landmarks {marked}; centres {centres}; off {off}"


def _pooled(values: Sequence[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return rms(np.array(known)) if known else None


def _pooled_pair(pairs: Sequence[tuple[float, float] | None]) -> tuple[float, float] | None:
    known = np.array([pair for pair in pairs if pair is not None])
    return (rms(known[:, 0]), rms(known[:, 1])) if len(known) else None


def _row(values: Iterable[float | None]) -> str:
    return " ".join("   –" if v is None else f"{v:4.1f}" for v in values)


def _pair(pair: tuple[float, float] | None) -> str:
    """Distances in cm, the model's own fit in brackets."""
    return "  – (  –)" if pair is None else f"{100 * pair[0]:3.1f} ({100 * pair[1]:3.1f})"
