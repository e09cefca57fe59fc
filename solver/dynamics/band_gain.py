"""Gain and phase of one motion against another by frequency band, as cross-spectrum over spectrum."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

FINER = 8  # bins an hertz of a second's segment, so that a band holds what lies between its edges


@dataclass(frozen=True)
class BandGain:
    """Of one frequency band."""

    low_Hz: float
    high_Hz: float
    gain: float  # 1: as large as in the reference
    phase_rad: float  # positive: ahead of the reference
    content: float  # RMS of the reference in the band, in its unit: where it is tiny, gain is that of noise


def band_gains(
    motion: Float[np.ndarray, "frames columns"],
    reference: Float[np.ndarray, "frames columns"],
    rate: float,
    bands_Hz: Sequence[tuple[float, float]],
) -> list[BandGain]:
    """Gain and phase by band, all columns together; bands without any content are left out.

    Welch's method (Hann windows of a second or the whole trial, half overlapping, without their trend). What
    the two share counts: noise that only the reference has lowers the gain as lost movement does.

    Args:
        motion: in any unit.
        reference: on the same frames, in the same unit.
        rate: [Hz].
        bands_Hz: from and below.
    """
    length = min(len(reference), round(rate))
    options = {"fs": rate, "nperseg": length, "nfft": FINER * length, "detrend": "linear", "axis": 0}
    from scipy.signal import csd, welch  # noqa: PLC0415 (slow to load; every reader of a fit leads here)

    frequency, each = welch(reference, **options)
    own = each.sum(axis=1)
    cross = csd(reference, motion, **options)[1].sum(axis=1)
    found = []
    for low, high in bands_Hz:
        band = (frequency >= low - 1e-9) & (frequency < high - 1e-9)
        if not band.any() or own[band].sum() == 0:
            continue
        ratio = cross[band].sum() / own[band].sum()
        content = np.sqrt(own[band].sum() * (frequency[1] - frequency[0]) / reference.shape[1])
        found.append(BandGain(low, high, float(np.abs(ratio)), float(np.angle(ratio)), float(content)))
    return found
