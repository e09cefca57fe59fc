"""Up to where residuals and marker errors are accepted in the field."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """Upper limits of the figures that a report calls good.

    Hicks et al. 2015 (J Biomech Eng 137:020905) for all but the last; that is the looser bound which the
    AddBiomechanics Dataset states beside them (Werling et al. 2024, table 2).
    """

    linear_BW: float = 0.05  # RMS residual force, body weights
    angular_BWh: float = 0.01  # RMS residual moment, body weight · height
    marker_rms_m: float = 0.02
    marker_max_m: float = 0.04  # over all marker-frames
    angular_paper_BWh: float = 0.1


@dataclass(frozen=True)
class Figures:
    """What the thresholds are held against; None where a figure was not computed."""

    linear_BW: float | None
    angular_BWh: float | None
    marker_rms_m: float | None
    marker_max_m: float | None


def verdicts(figures: Figures, thresholds: Thresholds) -> dict[str, bool | None]:
    """Pass or fail of each threshold; None where the figure is missing."""
    pairs = {
        "linear": (figures.linear_BW, thresholds.linear_BW),
        "angular": (figures.angular_BWh, thresholds.angular_BWh),
        "marker_rms": (figures.marker_rms_m, thresholds.marker_rms_m),
        "marker_max": (figures.marker_max_m, thresholds.marker_max_m),
        "angular_paper": (figures.angular_BWh, thresholds.angular_paper_BWh),
    }
    return {name: None if value is None else value <= limit for name, (value, limit) in pairs.items()}
