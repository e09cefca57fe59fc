"""What all direct checks start from: vertical motion of the body by its markers, and the plates beside it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.signal import savgol_coeffs

from solver.capture.capture import Capture, ForcePlate
from solver.capture.plates.conditioning import at_nearest_samples, fill_gaps
from solver.capture.resampling import covered, resample
from solver.capture.trial import ReadingSettings
from solver.common.gravity import GRAVITY
from solver.common.plate_figures import CONTACT_N
from solver.common.true_runs import runs

WINDOW_S = 0.12  # smoothing that heights and forces share: a quarter of a step's bounce
MISSING_SHARE = 0.25  # of what weight and motion ask for: where more is missing, a foot is beside the plates
FEWEST_S = 0.5  # of frames that count: half a step tells no weight
STANDING_SHARE = 0.6  # of body weight: in walking the plates bear more
STANDING_S = 1.0  # on two plates, for an exchange between them
EDGE_S = 0.14  # double support: how long a weight passes to the next foot

# Heights of ankle, knee and hip as shares of the highest marker's, and what lies below, between and above
# weighs of body mass (Winter 2009, tables 4.1 and fig. 4.1); hands hang at the hip and count as trunk.
BANDS = (0.06, 0.28, 0.55)
SHARES = (0.03, 0.09, 0.20, 0.68)


@dataclass(frozen=True, eq=False)
class Measured:
    """One trial, with what follows from it by itself."""

    capture: Capture
    reading: ReadingSettings

    @property
    def rate(self) -> float:
        """Of the markers [Hz]."""
        return self.capture.markers.rate

    @cached_property
    def acceleration(self) -> Float[np.ndarray, " frames"]:
        """Of the body, upwards, smoothed by cubics over a window [m/s²]; NaN at the ends and where unseen."""
        height = self._middle_height()
        half = self._half_window
        result = np.full(len(height), np.nan)
        if len(height) > 2 * half:
            weights = savgol_coeffs(2 * half + 1, 3, deriv=2, delta=1 / self.rate, use="dot")
            result[half : len(height) - half] = np.convolve(height, weights[::-1], mode="valid")
        return result

    @cached_property
    def vertical_N(self) -> Float[np.ndarray, "frames plates"]:
        """Of each plate, seen through the same window as the acceleration; NaN where not recorded."""
        columns = [self.smooth(plate) for plate in self.capture.plates]
        return np.stack(columns, axis=1) if columns else np.empty((len(self.acceleration), 0))

    def smooth(self, plate: ForcePlate, late_s: float = 0.0) -> Float[np.ndarray, " frames"]:
        """A plate's vertical force as means of the window's accelerations are taken, read `late_s` later."""
        times = self.capture.markers.times + late_s
        whole, recorded, _ = fill_gaps(plate, self.reading.conditioning)
        at_frames = resample(whole.force_ground[:, 1], whole.rate, whole.start_time, times)
        known = at_nearest_samples(recorded, plate, times) & covered(
            plate.rate, plate.start_time, plate.samples, times
        )
        at_frames = np.where(known, at_frames, np.nan)
        half = self._half_window
        result = np.full(len(times), np.nan)
        if len(times) > 2 * half:
            second = savgol_coeffs(2 * half + 1, 3, deriv=2, use="dot")
            mean = np.cumsum(np.cumsum(second))[:-2]
            mean /= mean.sum()
            result[half - 1 : len(times) - half + 1] = np.convolve(at_frames, mean[::-1], mode="valid")
        return result

    @cached_property
    def total_N(self) -> Float[np.ndarray, " frames"]:
        """Of all plates together."""
        total: Float[np.ndarray, " frames"] = self.vertical_N.sum(axis=1)
        return total

    @cached_property
    def whole(self) -> Bool[np.ndarray, " frames"]:
        """Frames on which the plates bear all: not much less than the mass of most frames asks for."""
        asked = GRAVITY + self.acceleration
        with np.errstate(invalid="ignore"):
            counts = (self.total_N > 10 * CONTACT_N) & (asked > 0.3 * GRAVITY)
        if not counts.any():
            return counts
        carried = np.where(counts, self.total_N / np.where(counts, asked, 1.0), np.nan)
        usual = np.nanpercentile(carried, 60)
        with np.errstate(invalid="ignore"):
            return counts & (np.abs(carried / usual - 1) < MISSING_SHARE)

    @cached_property
    def usual_kg(self) -> float | None:
        """Mass that most whole frames ask for; where these are few, all frames together."""
        whole, asked = self.whole, GRAVITY + self.acceleration
        if whole.sum() / self.rate >= FEWEST_S:
            return float(np.median(self.total_N[whole] / asked[whole]))
        known = np.isfinite(self.total_N) & np.isfinite(asked)
        if known.sum() / self.rate < FEWEST_S or self.total_N[known].sum() <= 0:
            return None
        return float(self.total_N[known].sum() / asked[known].sum())

    @cached_property
    def borne(self) -> Bool[np.ndarray, " frames"]:
        """Frames on which all is on plates, or the person flies, or passes from one to the other.

        Where a load begins or ends beside no flight, another foot may be beside the plates: its edges do not
        count.
        """
        known = np.isfinite(self.total_N) & np.isfinite(self.acceleration)
        if self.usual_kg is None:
            return np.zeros_like(known)
        weight_N, edge = self.usual_kg * GRAVITY, round(EDGE_S * self.rate)
        with np.errstate(invalid="ignore"):
            stands = known & (self.total_N > STANDING_SHARE * weight_N)
            flies = known & (self.total_N < 0.2 * weight_N) & (self.acceleration < -0.7 * GRAVITY)
        counts = known & (np.convolve(flies, np.ones(2 * edge + 1), mode="same") > 0.5)
        for start, end in runs(stands):
            first = start if start == 0 or not known[start - 1] else start + edge
            last = end if end == len(known) or not known[end] else end - edge
            counts[first : max(first, last)] = True
        return counts & known

    def _middle_height(self) -> Float[np.ndarray, " frames"]:
        """Of the markers, band by band as the body's mass is spread [m]."""
        height = self.capture.markers.positions_ground[:, :, 1]
        seen = np.isfinite(height).mean(axis=0) > 0.5 if len(height) else np.zeros(height.shape[1], bool)
        if not seen.any():
            return np.full(len(height), np.nan)
        height = _bridge_gaps(height[:, seen])
        typical = np.median(height, axis=0)
        low = typical.min()
        band = np.digitize((typical - low) / max(float(typical.max() - low), 1e-9), BANDS)
        middle, weight = np.zeros(len(height)), 0.0
        for k, share in enumerate(SHARES):
            weight += share
            if (band == k).any():
                middle = middle + weight * (height[:, band == k] - typical[band == k]).mean(axis=1)
                weight = 0.0
        return middle

    @property
    def _half_window(self) -> int:
        return max(2, round(0.5 * WINDOW_S * self.rate))


def _bridge_gaps(height: Float[np.ndarray, "frames markers"]) -> Float[np.ndarray, "frames markers"]:
    """Gaps bridged by lines: a marker that comes and goes must not move the mean."""
    frames = np.arange(len(height))
    filled = height.copy()
    for column in filled.T:
        known = np.isfinite(column)
        column[~known] = np.interp(frames[~known], frames[known], column[known])
    return filled


def measure_trials(captures: Sequence[Capture], reading: ReadingSettings) -> list[Measured]:
    """Trials that have plates and markers."""
    return [Measured(capture, reading) for capture in captures if capture.plates and capture.markers.frames]


def may_hide(trial: Measured, loaded: Bool[np.ndarray, "frames plates"], frame: int) -> bool:
    """Whether another foot may have been beside the plates there: nothing is loaded, and nobody flies."""
    if not 0 <= frame < len(loaded):
        return True
    flies = trial.acceleration[frame] < -0.5 * GRAVITY
    return not (loaded[frame].any() or flies)
