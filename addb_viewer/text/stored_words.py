"""What a recording's own file says of itself, in words, to stand beside what the fit found."""

from collections.abc import Sequence

from solver.fitting.fit_summary import StoredFigures


def stored_words(stored: Sequence[StoredFigures]) -> list[str]:
    """A sentence a pass."""
    return [_words(found) for found in stored]


def _words(found: StoredFigures) -> str:
    figures = [
        f"{name} {value * factor:.{digits}f} {unit}"
        for value, name, factor, digits, unit in (
            (found.marker_rms_m, "marker RMS", 100.0, 2, "cm"),
            (found.force_rms_N, "force", 1.0, 1, "N"),
            (found.moment_rms_Nm, "moment", 1.0, 1, "N·m about the root's Euler axes"),
        )
        if value is not None
    ]
    said = ", ".join(figures) or "no figures"
    notes = f" ({'; '.join(found.notes)})" if found.notes else ""
    return f"its file says of its {found.kind} pass, on the same frames: {said}{notes}"
