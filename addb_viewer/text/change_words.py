"""What the fit to forces changed in the motion, in words and rows."""

from collections.abc import Sequence
from dataclasses import dataclass

from addb_viewer.text.coordinate_words import coordinate_in_words
from solver.fitting.fit_summary import ChangeFigures, CoordinateFigures

MOST_NAMED = 2  # coordinates in the sentence
LEAST = 0.05  # [° or mm] smaller changes round to nothing

READING = (
    "A change is not an error in itself: the fit also removes errors of the markers from the motion. But a "
    "motion that was distorted to lower the residual shows here: a gain well below 1 where people move, "
    "smaller ranges, lower peak speeds."
)


@dataclass(frozen=True)
class ChangeRow:
    """One coordinate, each figure with its unit; empty where it was not computed."""

    coordinate: str
    rms: str
    offset: str
    bands: tuple[str, ...]
    gains: tuple[str, ...]  # by band, with the phase
    range: str
    peak_speed: str


def change_sentence(change: ChangeFigures | None) -> str:
    """In one line; empty where nothing was fitted to forces."""
    if change is None or change.joints_rms_deg is None:
        return ""
    most = [c for c in largest_first(change) if not c.root and c.unit == "deg"][:MOST_NAMED]
    named = ", ".join(f"{coordinate_in_words(c.name)} {c.rms:.1f}°" for c in most)
    parts = [
        f"The fit to forces moved the joints by {change.joints_rms_deg:.1f}° RMS "
        f"({change.joints_offset_deg:.1f}° of it constant)",
        f"most: {named}",
    ]
    if gain := change.joints_gain:
        parts.append(f"{100 * gain.gain:.0f} % of their movement at {band_in_words(gain.band_hz)} is left")
    return "; ".join(parts)


def change_key_findings(change: ChangeFigures | None) -> str:
    """The same in a few words."""
    if change is None or change.joints_rms_deg is None:
        return ""
    gain = change.joints_gain
    remains = f"; gain {gain.gain:.2f} at {band_in_words(gain.band_hz)}" if gain else ""
    return f"{change.joints_rms_deg:.1f}° RMS{remains}"


def change_rows(change: ChangeFigures) -> list[ChangeRow]:
    """Of every coordinate that was changed, in the model's order."""
    return [_row(c) for c in change.coordinates if c.rms >= LEAST]


def largest_first(change: ChangeFigures) -> Sequence[CoordinateFigures]:
    """The coordinates, those that were changed most at first: angles, then translations."""
    return sorted(change.coordinates, key=lambda c: (c.unit != "deg", -float(c.rms)))


def bands_in_words(change: ChangeFigures) -> list[str]:
    """The heads of the bands."""
    return [band_in_words(band) for band in change.bands_hz]


def band_in_words(band: Sequence[float | None]) -> str:
    """A frequency band, as 4–6 Hz."""
    low, high = band
    return f"above {low:g} Hz" if high is None else f"{low:g}–{high:g} Hz"


def signed(value: float, digits: int = 0) -> str:
    """With its sign, but for what rounds to nothing."""
    told = f"{value:+.{digits}f}"
    return told[1:] if float(told) == 0.0 else told


def limit_in_words(change: ChangeFigures) -> str:
    """What ranges and peaks are held against."""
    return f"the markers' motion, low-passed without lag at {change.limit_hz:g} Hz"


def _row(c: CoordinateFigures) -> ChangeRow:
    unit, speed, digits = ("°", "°/s", 1) if c.unit == "deg" else (" mm", " mm/s", 0)
    return ChangeRow(
        coordinate_in_words(c.name),
        f"{c.rms:.{digits}f}{unit}",
        f"{signed(c.offset, digits)}{unit}",
        tuple(f"{band:.2f}°" if unit == "°" else f"{band:.1f}{unit}" for band in c.bands),
        tuple("" if g is None else f"{g.gain:.2f}, {signed(g.phase_deg)}°" for g in c.gains),
        _compared(c.range, c.range_of_markers, unit),
        _compared(c.peak_speed, c.peak_speed_of_markers, speed),
    )


def _compared(fitted: float | None, markers: float | None, unit: str) -> str:
    if fitted is None or markers is None:
        return ""
    percent = f" ({signed(100 * (fitted / markers - 1))} %)" if markers > 0 else ""
    return f"{fitted:.0f}{unit}{percent}"
