"""The one low-pass that kinematics and forces share."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float
from scipy.linalg.lapack import dtbtrs

ORDER = 3  # of the single pass: as in the supplement of the paper on the dataset


def low_pass(
    values: Float[np.ndarray, "samples *columns"], rate: float, cutoff_Hz: float, order: int = ORDER
) -> Float[np.ndarray, "samples *columns"]:
    """Zero-phase Butterworth low-pass along the first axis (filtered forwards and backwards).

    Ends are continued by the series turned about its last value; a series of a few samples by as many as it
    has. A cutoff at or above the Nyquist frequency leaves everything: there is nothing above it.
    SciPy's own takes half a second to load.

    Args:
        values: one row a sample; no NaN.
        rate: [Hz].
        cutoff_Hz: corner of the single pass [Hz].
        order: of the single pass.
    """
    samples = values.shape[0]
    if cutoff_Hz >= rate / 2 or samples < 2:
        return values
    padding = min(3 * (2 * ((order + 1) // 2) + 1), samples - 1)
    series = np.asarray(values, dtype=float).reshape(samples, -1)
    before = 2 * series[0] - series[padding:0:-1]
    after = 2 * series[-1] - series[-2 : -padding - 2 : -1]
    series = np.concatenate([before, series, after])
    sections = _sections(order, cutoff_Hz / rate)
    for _ in range(2):
        series = _passed(series, sections)[::-1]
    return series[padding : padding + samples].reshape(values.shape)


def _passed(
    series: Float[np.ndarray, "samples columns"], sections: tuple[tuple[float, float], ...]
) -> Float[np.ndarray, "samples columns"]:
    """The single pass, section by section, as if the first sample had always been there.

    y[n] + a₁ y[n-1] + a₂ y[n-2] = b (x[n] + 2 x[n-1] + x[n-2]) is a lower triangular system with two bands
    below its diagonal.
    """
    start = series[0]
    y = series - start
    for first, second in sections:
        is_pair = second != 0.0
        for _ in range(1 + is_pair):
            y[1:] += y[:-1].copy()
        y *= (1 + first + second) / (4 if is_pair else 2)
        bands = np.empty((3, len(y)))
        bands[0], bands[1], bands[2] = 1.0, first, second
        y = dtbtrs(bands, y, uplo="L", diag="U")[0]
    return y + start


@lru_cache(maxsize=256)
def _sections(order: int, cutoff: float) -> tuple[tuple[float, float], ...]:
    """Coefficients a₁, a₂ of each pair of poles; a₂ is zero where a pole is single.

    The analogue filter's poles lie on a circle; the bilinear transform takes them into the unit circle.

    Args:
        order: of the single pass.
        cutoff: corner, as a share of the rate.
    """
    upper = np.exp(1j * np.pi * (2 * np.arange((order + 1) // 2) + order + 1) / (2 * order))
    analogue = np.tan(np.pi * cutoff) * upper
    poles = (1 + analogue) / (1 - analogue)
    pairs = [(float(-2 * pole.real), float(abs(pole) ** 2)) for pole in poles[: order // 2]]
    return (*pairs, *((float(-pole.real), 0.0) for pole in poles[order // 2 :]))
