"""What the plots show, as plain arrays."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.trial_view.drawn_curves import marker_errors_of
from addb_viewer.trial_view.palette import BLUE, GREY, OTHER_CURVE, PLATES, RESIDUAL, Rgb, foot_color
from addb_viewer.trial_view.replay import Replay
from annotations.foot_names import foot_words
from solver.dynamics.thresholds import Thresholds

BEFORE = "before"  # legend of the solve that is compared with


@dataclass(frozen=True)
class Line:
    """One curve; NaN where unknown."""

    label: str
    values: Float[np.ndarray, " frames"]
    color: Rgb
    dashed: bool = False  # a bound
    dotted: bool = False  # of the solve that is compared with
    std: Float[np.ndarray, " frames"] | None = None  # NaN where none is known

    @property
    def is_own(self) -> bool:
        """Of the fit that is shown."""
        return not (self.dashed or self.dotted)


@dataclass(frozen=True)
class Chart:
    """Curves on one axis, over time."""

    title: str
    unit: str
    lines: tuple[Line, ...]
    shaded: Bool[np.ndarray, " frames"] | None = None  # frames that the figures do not count
    runs_off: bool = False  # sizes: the axis holds what counts, and what is larger may leave it

    @cached_property
    def largest(self) -> float:
        """The largest size of a value on any curve that is no bound."""
        curves = (line.values for line in self.lines if not line.dashed)
        return max((float(np.nanmax(np.abs(values), initial=0.0)) for values in curves), default=0.0)

    @property
    def heading(self) -> str:
        """Title with unit."""
        return f"{self.title} [{self.unit}]"


def charts_of(replay: Replay, other: Replay | None = None) -> tuple[Chart, ...]:
    """The charts of markers, plates and residuals that this trial has data for.

    Args:
        replay: the trial.
        other: the same trial as another solve has it, drawn behind.
    """
    return (*_marker_chart(replay, other), *_force_chart(replay), *_residual_charts(replay, other))


def _marker_chart(replay: Replay, other: Replay | None) -> Iterator[Chart]:
    rms, largest = (100.0 * errors for errors in marker_errors_of(replay.markers))  # [cm]
    known = np.isfinite(rms)
    if not known.any():
        return
    limits = Thresholds()
    before = () if other is None else (before_line(100.0 * marker_errors_of(other.markers)[0]),)
    yield Chart(
        "Marker error",
        "cm",
        (
            *before,
            Line("largest", largest, GREY),
            Line("RMS", rms, BLUE),
            _limit(f"{100 * limits.marker_rms_m:g} cm", 100 * limits.marker_rms_m, replay.frames),
        ),
        shaded=~known,
        runs_off=True,
    )


def _force_chart(replay: Replay) -> Iterator[Chart]:
    if not replay.plates:
        return
    measured = np.stack([np.isfinite(plate.force[:, 1]) for plate in replay.plates])
    shaded = np.asarray(~measured.any(axis=0))
    yield Chart("Vertical force", "N", (*_of_feet(replay), *_of_plates(replay)), shaded=shaded)


def _of_feet(replay: Replay) -> Iterator[Line]:
    """What all plates together measure under each foot, in its colour."""
    for k, foot in enumerate(replay.feet):
        under = [np.where(plate.foot == k, plate.force[:, 1], 0.0) for plate in replay.plates]
        yield Line(foot_words(foot), np.sum(under, axis=0), foot_color(foot, k))


def _of_plates(replay: Replay) -> Iterator[Line]:
    """Where no foot is known, what each plate measures."""
    for i, plate in enumerate(replay.plates):
        if not replay.feet or not (plate.foot >= 0).any():
            yield Line(plate.name, plate.force[:, 1], PLATES[i % len(PLATES)])


def _residual_charts(replay: Replay, other: Replay | None) -> Iterator[Chart]:
    residual = replay.residual
    if residual is None or not np.isfinite(residual.force).any():
        return
    limits = Thresholds()
    was = None if other is None else other.residual
    for title, unit, now, then, bound in (
        (
            "Residual force",
            "N",
            residual.force,
            None if was is None else was.force,
            _limit(f"{100 * limits.linear_BW:g} % BW", residual.force_limit, replay.frames),
        ),
        (
            "Residual moment",
            "N·m",
            residual.moment,
            None if was is None else was.moment,
            _limit(f"{100 * limits.angular_BWh:g} % BW·h", residual.moment_limit, replay.frames),
        ),
    ):
        before = () if then is None else (before_line(np.linalg.norm(then, axis=1)),)
        size = Line("size", np.linalg.norm(now, axis=1), RESIDUAL)
        yield Chart(title, unit, (*before, size, bound), shaded=~residual.used, runs_off=True)


def before_line(values: Float[np.ndarray, " frames"]) -> Line:
    """Of the solve that is compared with."""
    return Line(BEFORE, values, OTHER_CURVE, dotted=True)


def _limit(label: str, value: float, frames: int) -> Line:
    return Line(label, np.full(frames, value), GREY, dashed=True)
