"""Gain and phase of one motion against another by frequency band, as cross-spectrum over spectrum."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float

FINER = 8  # bins an hertz of a second's segment, so that a band holds what lies between its edges
AT_ONCE = 60  # windows


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
    options = {"fs": rate, "nperseg": length, "nfft": FINER * length, "detrend": "linear", "axis": 0}
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


def band_gains(
    motion: Float[np.ndarray, "frames columns"],
    reference: Float[np.ndarray, "frames columns"],
    rate: float,
    bands_Hz: Sequence[tuple[float, float]],
) -> list[BandGain]:
    """Gain and phase by band, all columns together; see `Spectra.gains`.

    Args:
        motion: in any unit.
        reference: on the same frames, in the same unit.
        rate: [Hz].
        bands_Hz: from and below.
    """
    return spectra_of(motion, reference, rate).gains(bands_Hz, slice(None))
