"""What the fit to forces changed in the motion of the markers alone: by coordinate and frequency band.

A change is no error by itself: noise of the markers goes, too. But a residual that is small because the
motion was bent shows here: movement in the bands where people move is lost, ranges shrink, peaks flatten.

Gain and phase of one motion against another by frequency band, as cross-spectrum over spectrum.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.fft import dct

from solver.kinematics.frame_solver import root_dofs
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

BINS_PER_HERTZ = 8  # bins an hertz of a second's segment, so that a band holds what lies between its edges
AT_ONCE = 60  # windows

BANDS_HZ = ((0.0, 2.0), (2.0, 4.0), (4.0, 6.0), (6.0, 10.0), (10.0, np.inf))

# Below which frequency movement is expected: running and jumping, walking, squatting and sitting down.
FAST_HZ, USUAL_HZ, SLOW_HZ = 10.0, 6.0, 4.0
# Share of the speeds' power below 10 Hz that lies above 4 Hz. On recordings: squat 1.8 %, sitting 2.8 %,
# walks 5 to 13 % (one with restless markers 50 %), run 19 %, jumps and sprint 30 to 55 %.
FAST_SHARE, SLOW_SHARE = 0.15, 0.04
# From where a gain is one of movement: markers' own errors of 1 mm turn a segment of 0.3 m by 0.2°.
LEAST_CONTENT_RAD, LEAST_CONTENT_M = np.radians(0.2), 0.001
ENDS_S = 0.1  # left out of ranges and peaks: filters and splines know no motion beyond


@dataclass(frozen=True)
class BandGain:
    """Of one frequency band."""

    low_Hz: float
    high_Hz: float
    gain: float  # 1: as large as in the reference
    phase_rad: float  # positive: ahead of the reference
    content: float  # RMS of the reference in the band, in its unit: where it is tiny, gain is that of noise


@dataclass(frozen=True)
class Spectra:
    """Of several columns, by Welch's method."""

    frequency_Hz: Float[np.ndarray, " bins"]
    own: Float[np.ndarray, "bins columns"]  # power density of the reference
    cross: Complex[np.ndarray, "bins columns"]  # of the motion with the reference

    def gains(
        self, bands_Hz: Sequence[tuple[float, float]], columns: slice | Bool[np.ndarray, " columns"]
    ) -> list[BandGain]:
        """Gain and phase by band, of some columns together; bands without any content are left out.

        What the two share counts: noise that only the reference has lowers the gain as lost movement does.

        Args:
            bands_Hz: from and below.
            columns: which.
        """
        found = []
        of_each = self.own[:, columns]
        own, cross = of_each.sum(axis=1), self.cross[:, columns].sum(axis=1)
        for low, high in bands_Hz:
            band = (self.frequency_Hz >= low - 1e-9) & (self.frequency_Hz < high - 1e-9)
            if not band.any() or own[band].sum() == 0:
                continue
            ratio = cross[band].sum() / own[band].sum()
            content = np.sqrt(own[band].sum() * self.frequency_Hz[1] / of_each.shape[1])
            found.append(BandGain(low, high, float(np.abs(ratio)), float(np.angle(ratio)), float(content)))
        return found


def spectra_of(
    motion: Float[np.ndarray, "frames columns"], reference: Float[np.ndarray, "frames columns"], rate: float
) -> Spectra:
    """Spectra of a motion against another: Hann windows of a second or the whole trial, half overlapping.

    Each window is without its trend. SciPy holds the spectra of all windows at once, of a long trial
    gigabytes: it is given some windows at a time.

    Args:
        motion: in any unit.
        reference: on the same frames, in the same unit.
        rate: [Hz].
    """
    from scipy.signal import csd, welch  # noqa: PLC0415 (slow to load; every reader of a fit leads here)

    length = min(len(reference), round(rate))
    options = {"fs": rate, "nperseg": length, "nfft": BINS_PER_HERTZ * length, "detrend": "linear", "axis": 0}
    step = length - length // 2
    windows = (len(reference) - length) // step + 1
    own, cross = np.zeros(()), np.zeros(())
    for first in range(0, windows, AT_ONCE):
        count = min(AT_ONCE, windows - first)
        some = slice(first * step, (first + count - 1) * step + length)
        frequency, each = welch(reference[some], **options)
        own = own + each * count / windows
        cross = cross + csd(reference[some], motion[some], **options)[1] * count / windows
    return Spectra(frequency, own, cross)


@dataclass(frozen=True)
class CoordinateChange:
    """Of one coordinate, in rad or m."""

    name: str
    turning: bool
    root: bool  # places the whole body in the ground: of no joint
    rms: float  # of all of the change
    offset: float  # its mean, with sign: fitted less markers'
    bands: tuple[float, ...]  # RMS by `BANDS_HZ`, without the mean; squares add up to rms² - offset²
    gains: tuple[BandGain | None, ...]  # by `BANDS_HZ`; None where the markers' motion holds too little
    range: float | None  # from the least to the greatest value; None: the trial is too short to tell
    range_of_markers: float | None  # below the limit
    peak_speed: float | None  # [rad/s or m/s]
    peak_speed_of_markers: float | None  # below the limit


@dataclass(frozen=True)
class MotionChange:
    """Of one trial."""

    limit_Hz: float  # below it the movement is expected to stay
    coordinates: tuple[CoordinateChange, ...]  # in the skeleton's order
    joints_rms_rad: float | None  # over all turning coordinates but the root joint's; None: there are none
    joints_offset_rad: float | None  # RMS of their means
    joints_gain: BandGain | None  # of all of them, in the highest band below the limit


def motion_change(skeleton: Skeleton, fitted: Motion, markers: Motion) -> MotionChange:
    """How the fitted motion differs from that of the markers alone.

    Args:
        skeleton: that both motions are of.
        fitted: to markers and forces.
        markers: fitted to markers alone, unfiltered.
    """
    turning = np.array([c.motion == "rotation" for c in skeleton.free_coordinates], dtype=bool)
    root = root_dofs(skeleton)
    joints = turning & ~root
    limit = expected_limit_Hz(markers, joints)
    spectra = spectra_of(fitted.q, markers.q, fitted.rate)
    coordinates = []
    for i in range(len(skeleton.dofs)):
        least = LEAST_CONTENT_RAD if turning[i] else LEAST_CONTENT_M
        gains = {g.low_Hz: g for g in spectra.gains(BANDS_HZ, slice(i, i + 1)) if g.content >= least}
        kind = {"turning": bool(turning[i]), "root": bool(root[i])}
        coordinates.append(_coordinate_change(_alone(fitted, i), _alone(markers, i), limit, gains, **kind))
    if not joints.any():
        return MotionChange(limit, tuple(coordinates), None, None, None)
    highest = [band for band in BANDS_HZ if band[1] == limit]
    enough = [g for g in spectra.gains(highest, joints) if g.content >= LEAST_CONTENT_RAD]
    turned = [one for one, joint in zip(coordinates, joints, strict=True) if joint]
    return MotionChange(
        limit,
        tuple(coordinates),
        _rms(np.array([one.rms for one in turned])),
        _rms(np.array([one.offset for one in turned])),
        enough[0] if enough else None,
    )


def _alone(motion: Motion, i: int) -> Motion:
    """One coordinate of a motion: of a long trial, all derivatives at once take a gigabyte."""
    return replace(motion, dofs=(motion.dofs[i],), q=motion.q[:, [i]])


def _coordinate_change(
    fitted: Motion,
    markers: Motion,
    limit_Hz: float,
    gains: Mapping[float, BandGain],
    *,
    turning: bool,
    root: bool,
) -> CoordinateChange:
    """Of motions with this coordinate alone."""
    change = fitted.q - markers.q
    its_range, peak = _range_and_peak(fitted, ENDS_S)
    range_of_markers, peak_of_markers = _range_and_peak(markers.low_passed(limit_Hz), ENDS_S)
    return CoordinateChange(
        fitted.dofs[0],
        turning,
        root,
        _rms(change),
        float(change.mean()),
        tuple(float(b) for b in band_rms(change, fitted.rate, BANDS_HZ)[:, 0]),
        tuple(gains.get(low) for low, _ in BANDS_HZ),
        its_range,
        range_of_markers,
        peak,
        peak_of_markers,
    )


def expected_limit_Hz(markers: Motion, joints: Bool[np.ndarray, " dofs"]) -> float:
    """Below which frequency [Hz] the movement is expected: by how much of the joints' speed is fast.

    Args:
        markers: motion of the markers alone.
        joints: turning coordinates to look at.
    """
    bands, power = ((0.0, SLOW_HZ), (SLOW_HZ, 10.0)), np.zeros(2)
    for i in np.flatnonzero(joints):
        power += band_rms(_alone(markers, int(i)).velocity, markers.rate, bands)[:, 0] ** 2
    slow, fast = power
    if slow + fast == 0:
        return USUAL_HZ
    share = fast / (slow + fast)
    if share > FAST_SHARE:
        return FAST_HZ
    return SLOW_HZ if share < SLOW_SHARE else USUAL_HZ


def band_rms(
    values: Float[np.ndarray, "frames columns"], rate: float, bands_Hz: Sequence[tuple[float, float]]
) -> Float[np.ndarray, "bands columns"]:
    """Root mean square by frequency band, without the mean; over bands without gaps squares add up.

    By the cosine transform, which continues a series by its mirror image: a trend does not leak upwards.

    Args:
        values: in any unit.
        rate: [Hz].
        bands_Hz: from and below.
    """
    frames = len(values)
    power = dct(values - values.mean(axis=0), axis=0, norm="ortho") ** 2 / frames
    frequency = np.arange(frames) * rate / (2 * frames)
    inside = [(frequency >= low) & (frequency < high) for low, high in bands_Hz]
    return np.sqrt(np.stack([power[band].sum(axis=0) for band in inside]))


def _range_and_peak(motion: Motion, ends_s: float) -> tuple[float, float] | tuple[None, None]:
    """Range and peak speed away from the ends; None for trials that are hardly longer than these."""
    cut = round(ends_s * motion.rate)
    if motion.frames < 4 * cut:
        return None, None
    inner = slice(cut, motion.frames - cut)
    return float(np.ptp(motion.q[inner])), float(np.abs(motion.velocity[inner]).max())


def _rms(values: Float[np.ndarray, "..."]) -> float:
    return float(np.sqrt(np.mean(values**2)))
