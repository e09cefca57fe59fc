"""What a recording's own file says of itself, in words, to stand beside what the fit found."""

from collections.abc import Mapping, Sequence
from typing import Any


def stored_words(stored: Sequence[Mapping[str, Any]]) -> list[str]:
    """A sentence a pass.

    Args:
        stored: of a trial, as `solver.fitting.summary.summary` has it.
    """
    return [_words(found) for found in stored]


def _words(found: Mapping[str, Any]) -> str:
    figures = [
        f"{name} {found[key] * factor:.{digits}f} {unit}"
        for key, name, factor, digits, unit in (
            ("marker_rms_m", "marker RMS", 100.0, 2, "cm"),
            ("force_rms_N", "force", 1.0, 1, "N"),
            ("moment_rms_Nm", "moment", 1.0, 1, "N·m about the root's Euler axes"),
        )
        if found[key] is not None
    ]
    said = ", ".join(figures) or "no figures"
    notes = f" ({'; '.join(found['notes'])})" if found["notes"] else ""
    return f"its file says of its {found['pass']} pass, on the same frames: {said}{notes}"
