"""A trial's figures against the bounds of the field."""

from dataclasses import dataclass

from solver.dynamics.thresholds import Thresholds
from solver.fitting.fit_summary import TrialFigures

LARGEST_MARKER = "Largest marker error"
SOURCE = "Hicks et al. 2015 (10.1115/1.4029304)"


@dataclass(frozen=True)
class Judged:
    """One figure of a trial beside its bound."""

    label: str
    value: str  # with its unit; empty where it was not computed
    scaled: str  # the same in the bound's unit, where that is another
    bound: str
    share: float | None  # of the bound
    within: bool | None

    @property
    def words(self) -> str:
        """The value in both units; empty where it was not computed."""
        return f"{self.value} = {self.scaled}" if self.value and self.scaled else self.value


def judged_figures(figures: TrialFigures) -> tuple[Judged, ...]:
    """The four figures that have a bound, and whether each is within."""
    limits, hicks = Thresholds(), figures.hicks
    force, moment = figures.linear_residual, figures.angular_residual
    bw, bwh = figures.force_BW, figures.moment_BWh
    return (
        Judged(
            "Residual force, RMS",
            figure_words(force and force.rms_N, "N", 1),
            figure_words(bw, "BW", 4),
            f"{limits.linear_BW:g} BW",
            _share(bw, limits.linear_BW),
            hicks.linear,
        ),
        Judged(
            "Residual moment, RMS",
            figure_words(moment and moment.rms_Nm, "N·m", 1),
            figure_words(bwh, "BW·h", 4),
            f"{limits.angular_BWh:g} BW·h",
            _share(bwh, limits.angular_BWh),
            hicks.angular,
        ),
        _marker("Marker error, RMS", figures.marker_rms_m, limits.marker_rms_m, hicks.marker_rms),
        _marker(LARGEST_MARKER, figures.marker_max_m, limits.marker_max_m, hicks.marker_max),
    )


def figure_words(value: float | None, unit: str, digits: int) -> str:
    """With its unit; empty where it was not computed."""
    return "" if value is None else f"{value:.{digits}f} {unit}"


def length_words(value_m: float | None) -> str:
    """In cm; empty where it was not computed."""
    return "" if value_m is None else f"{100 * value_m:.2f} cm"


def _marker(label: str, value_m: float | None, bound_m: float, within: bool | None) -> Judged:
    value = length_words(value_m)
    return Judged(label, value, "", f"{100 * bound_m:g} cm", _share(value_m, bound_m), within)


def _share(value: float | None, bound: float) -> float | None:
    return None if value is None else value / bound
