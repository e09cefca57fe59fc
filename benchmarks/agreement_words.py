"""The figures of two fits' agreement as lines of a table."""

from collections.abc import Sequence

import numpy as np

from benchmarks.fit_agreement import ANGLES, JOINTS, Agreement, rms

HEADER = (
    "hip° knee° ankle° (offset off)  by landmarks   hip knee ankle cm   "
    "off the functional centre (the model's own fit) hip knee ankle cm"
)


def figures(found: Agreement) -> str:
    """Markers used, their RMS [cm], and how far the fits lie apart."""
    return f"{found.markers_used:3d}   {100 * found.marker_rms_m:5.2f}  {apart(found)}"


def apart(found: Agreement) -> str:
    """Angles [°], also without each side's offset and by landmarks; centres and off functional ones [cm]."""
    angles = " ".join(f"{found.angle_rms_deg[a]:5.1f}" for a in ANGLES)
    free = " ".join(f"{found.angle_rms_without_offset_deg[a]:4.1f}" for a in ANGLES)
    by_landmarks = " ".join(_or_dash(found.anatomical_rms_deg[a]) for a in ANGLES)
    centres = " ".join(f"{100 * found.centre_rms_m[j]:4.1f}" for j in JOINTS)
    functional = (found.off_functional_m[j] for j in JOINTS)
    off = "  ".join(
        "  – (  –)" if pair is None else f"{100 * pair[0]:3.1f} ({100 * pair[1]:3.1f})" for pair in functional
    )
    return f"{angles}  ({free})  {by_landmarks}   {centres}   {off}"


def _or_dash(value: float | None) -> str:
    return "   –" if value is None else f"{value:4.1f}"


def together(found: Sequence[Agreement]) -> str:
    """RMS over recordings of each figure, where it is known."""
    angles = [rms(np.array([f.angle_rms_deg[a] for f in found])) for a in ANGLES]
    marked = [[f.anatomical_rms_deg[a] for f in found if f.anatomical_rms_deg[a] is not None] for a in ANGLES]
    centres = [100 * rms(np.array([f.centre_rms_m[j] for f in found])) for j in JOINTS]
    told = [[f.off_functional_m[j] for f in found if f.off_functional_m[j] is not None] for j in JOINTS]
    off = [100 * np.sqrt(np.mean(np.square(pairs), axis=0)) for pairs in told]
    figures = (
        "angles " + " ".join(f"{v:.1f}" for v in angles),
        "by landmarks " + " ".join(f"{rms(np.array(v)):.1f}" for v in marked),
        "centres " + " ".join(f"{v:.1f}" for v in centres),
        "off the functional ones " + " ".join(f"{a:.1f} (model {m:.1f})" for a, m in off),
    )
    return "RMS over recordings: " + "; ".join(figures)
