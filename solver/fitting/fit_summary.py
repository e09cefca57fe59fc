"""What is said of a fit in figures: one typed answer for the terminal, pages, tables and JSON.

SI units where a name ends in no other; ranges of frames end before their second number; what was not computed
is None.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import final

from solver.common.errors import ResultsError
from solver.common.notes import Note
from solver.common.small_files import json_content
from solver.common.typed_json import from_plain
from solver.dynamics.thresholds import Thresholds, Verdicts
from solver.fitting.verdict import Reason, Use, Verdict, Why

Span = tuple[int, int]  # [frame]
Pair = tuple[float, float]


@final
@dataclass(frozen=True)
class ForceFigures:
    """Of residual forces."""

    rms_N: float
    mean_norm_N: float
    rms_BW: float | None  # [body weights]; None: the mass is unknown


@final
@dataclass(frozen=True)
class MomentFigures:
    """Of residual moments."""

    rms_Nm: float
    mean_norm_Nm: float
    rms_BWh: float | None  # [body weight · height]; None: mass or height are unknown


@final
@dataclass(frozen=True)
class LabelFaultFigures:
    """What was repaired in the labels before the fit; distances are None where a person said it."""

    labels: tuple[str, ...]
    frames: Span
    done: str
    frames_with_markers: int
    onto: str | None
    off_m: float | None
    repaired_off_m: float | None
    neighbours: int | None
    accepted: bool


@final
@dataclass(frozen=True)
class StoredFigures:
    """What the recording's own file says of a pass, on the frames of the fit's own figures."""

    kind: str  # of the pass
    marker_rms_m: float | None
    force_rms_N: float | None
    moment_rms_Nm: float | None
    notes: tuple[str, ...]


@final
@dataclass(frozen=True)
class HeldOutFigures:
    """Residuals on held-out blocks, beside those of the fit's and the markers' motion on the same frames."""

    frames: int
    learnt: tuple[str, ...]  # terms that were used to predict
    markers_cutoff_hz: Pair  # of the markers' motion, for forces and moments
    linear_residual: ForceFigures
    angular_residual: MomentFigures
    motion_only_linear_residual: ForceFigures
    motion_only_angular_residual: MomentFigures
    kinematics_only_linear_residual: ForceFigures
    kinematics_only_angular_residual: MomentFigures


@final
@dataclass(frozen=True)
class MissedFigures:
    """RMS [N or N·m] missed by fit and markers, and their ratio with its 90 % interval over blocks."""

    rms: float
    markers_rms: float
    markers_cutoffs_hz: Pair  # lowest and highest that layouts chose for the markers
    ratio: float | None
    ratio_90: Pair | None


@final
@dataclass(frozen=True)
class LayoutFigures:
    """Of all layouts of one kind."""

    layouts: int
    pieces: int
    frames: int
    force: MissedFigures
    moment: MissedFigures


@final
@dataclass(frozen=True)
class LayoutsFigures:
    """All layouts of a trial."""

    blocks: LayoutFigures | None
    steps: LayoutFigures | None


@final
@dataclass(frozen=True)
class MarkersAloneFigures:
    """Of the marker fit that the dynamics started from, and how far the angles moved since."""

    marker_rms_m: float | None
    marker_max_m: float | None
    change_rms_rad: float | None


@final
@dataclass(frozen=True)
class GainFigures:
    """How much of a movement is left in a band of frequencies."""

    band_hz: tuple[float, float | None]
    gain: float
    phase_deg: float
    content: float  # of the markers' motion [° or mm]


@final
@dataclass(frozen=True)
class CoordinateFigures:
    """What changed in one coordinate [° or mm, and per second]."""

    name: str
    unit: str
    root: bool
    rms: float
    offset: float
    bands: tuple[float, ...]
    gains: tuple[GainFigures | None, ...]
    range: float | None
    range_of_markers: float | None
    peak_speed: float | None
    peak_speed_of_markers: float | None


@final
@dataclass(frozen=True)
class ChangeFigures:
    """What the fit to forces changed in the motion of the markers alone."""

    limit_hz: float
    bands_hz: tuple[tuple[float, float | None], ...]
    joints_rms_deg: float | None
    joints_offset_deg: float | None
    joints_gain: GainFigures | None
    coordinates: tuple[CoordinateFigures, ...]


@final
@dataclass(frozen=True)
class TrialFigures:
    """Of one trial."""

    name: str
    frames: int
    rate_hz: float | None
    frames_with_force_used: int
    frames_used_ranges: tuple[Span, ...]
    frames_without_pose_ranges: tuple[Span, ...]
    coordinates_guessed_ranges: Mapping[str, tuple[Span, ...]]  # markers are out of view; there is no value
    mask_source: str  # who chose the frames, " + " between them
    marker_rms_m: float | None
    marker_rms_frame_mean_m: float | None
    marker_max_m: float | None
    linear_residual: ForceFigures | None
    angular_residual: MomentFigures | None
    linear_residual_raw: ForceFigures | None
    angular_residual_raw: MomentFigures | None
    label_faults: tuple[LabelFaultFigures, ...]
    torques_predicted_ranges: tuple[Span, ...]
    forces_predicted: bool
    hicks: Verdicts
    held_out: HeldOutFigures | None
    kinematics_only: MarkersAloneFigures | None
    change: ChangeFigures | None
    stored: tuple[StoredFigures, ...]
    seconds: Mapping[str, float | None]
    held_out_layouts: LayoutsFigures | None
    marker_max_label: str | None = None  # of the marker with the largest error; None: an earlier fit
    verdict: Verdict | None = None  # by these figures alone
    torque_std_Nm: Mapping[str, float] = field(default_factory=dict)  # by joint angle, median of used frames

    def judged(self) -> Verdict:
        """The verdict that these figures allow by themselves.

        Residuals beyond their limit leave the angles, as do forces that were not measured. The error of all
        markers beyond its limit leaves nothing. A single marker beyond its limit only spoils what is near it.
        """
        limits = Thresholds()
        known = [
            Reason(why, leaves, value / limit, of)
            for why, value, limit, leaves, of in (
                (Why.MARKERS, self.marker_rms_m, limits.marker_rms_m, Use.NOTHING, ""),
                (Why.MOMENT, self.moment_BWh, limits.angular_BWh, Use.ANGLES, ""),
                (Why.FORCE, self.force_BW, limits.linear_BW, Use.ANGLES, ""),
                (
                    Why.MARKER,
                    self.marker_max_m,
                    limits.marker_max_m,
                    Use.TORQUES,
                    self.marker_max_label or "",
                ),
            )
            if value is not None
        ]
        posed = self.frames - sum(end - start for start, end in self.frames_without_pose_ranges)
        counting = self.frames_with_force_used
        nearest = max(known, key=lambda reason: reason.share or 0.0, default=None)
        whole = Verdict(Use.TORQUES, (), nearest, self.frames, counting, posed)
        if not posed or self.marker_rms_m is None:
            return whole.also([Reason(Why.NO_POSE, Use.NOTHING)])
        none = Why.NO_FORCES if self.mask_source == "none" else Why.NO_FRAMES
        lacking = [] if counting else [Reason(none, Use.ANGLES)]
        return whole.also([*lacking, *(reason for reason in known if (reason.share or 0.0) > 1.0)])

    @property
    def force_BW(self) -> float | None:
        """RMS residual force [body weights]."""
        return self.linear_residual and self.linear_residual.rms_BW

    @property
    def moment_BWh(self) -> float | None:
        """RMS residual moment [body weight · height]."""
        return self.angular_residual and self.angular_residual.rms_BWh

    @property
    def masks(self) -> tuple[str, ...]:
        """Who chose the frames."""
        return tuple(self.mask_source.split(" + "))


@final
@dataclass(frozen=True)
class PersonFigures:
    """Of the subject."""

    mass_kg: float | None
    mass_entered_kg: float | None
    height_m: float | None
    mass_std_kg: float | None = None  # None: no force told it


@final
@dataclass(frozen=True)
class ModelFigures:
    """Of the skeleton."""

    bodies: int
    dofs: int


@final
@dataclass(frozen=True)
class NotUsed:
    """A file of the subject's folder that the fit does not use."""

    file: str
    reason: str


@final
@dataclass(frozen=True)
class FitSummary:
    """Of a subject."""

    subject: PersonFigures
    model: ModelFigures
    trials: tuple[TrialFigures, ...]
    files: tuple[str, ...]
    notes: tuple[Note, ...]
    unused: tuple[NotUsed, ...]

    def trial(self, name: str) -> TrialFigures | None:
        """The figures of a trial; None where the fit has none of this name."""
        return next((trial for trial in self.trials if trial.name == name), None)


def read_summary(path: Path) -> FitSummary:
    """The figures in a `fit.json`, or in what `fit --json` wrote.

    Raises:
        FileNotFoundError: there is none.
        ResultsError: it cannot be read.
    """
    try:
        return from_plain(json_content(path), FitSummary)
    except FileNotFoundError:
        raise
    except (OSError, ValueError, TypeError) as error:
        raise ResultsError(f"{path}: cannot be read ({error}); fit the subject again") from error
