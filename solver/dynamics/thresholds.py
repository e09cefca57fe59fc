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
class Verdicts:
    """Whether each threshold is kept; None where the figure is missing."""

    linear: bool | None
    angular: bool | None
    marker_rms: bool | None
    marker_max: bool | None
    angular_paper: bool | None


def verdicts(
    linear_BW: float | None,
    angular_BWh: float | None,
    marker_rms_m: float | None = None,
    marker_max_m: float | None = None,
) -> Verdicts:
    """Pass or fail of each threshold; arguments as they are called there."""
    limits = Thresholds()

    def kept(value: float | None, limit: float) -> bool | None:
        return None if value is None else value <= limit

    return Verdicts(
        linear=kept(linear_BW, limits.linear_BW),
        angular=kept(angular_BWh, limits.angular_BWh),
        marker_rms=kept(marker_rms_m, limits.marker_rms_m),
        marker_max=kept(marker_max_m, limits.marker_max_m),
        angular_paper=kept(angular_BWh, limits.angular_paper_BWh),
    )
