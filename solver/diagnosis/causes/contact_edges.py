"""How steeply a plate's vertical force falls off with frequency where feet strike and leave.

A contact begins and ends within some hundredths of a second, whatever the person does in between: from 8 to
20 Hz its spectrum falls by four to fifteen times. A low-pass of 2nd order run forwards and backwards falls by
f⁻⁴ beyond its cutoff, which makes that thirty times more. Frames near the ends of a recording do not count:
a load that is cut there has a spectrum of its own.
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float
from scipy.signal.windows import blackmanharris

from solver.common.plate_figures import CONTACT_N
from solver.common.statistics import log_t
from solver.common.true_runs import runs

SLOW_HZ, QUICK_HZ = 8.0, 20.0
REACH_S = 0.17  # of the window: sidelobes are 92 dB down, below what 20 Hz have of 3 Hz
NEAR_S = 0.06  # of an edge, within which the largest amplitude counts
SOUND, SOUND_STD = -1.9, 0.65  # of the logarithm: 17 sound trials of twelve people, walks, runs, jumps
FILTERED, FILTERED_STD = -5.2, 0.9  # of the same with cutoffs of 4 to 8 Hz
FALL_OF_4_HZ = (4.0, -6.6)  # the mean of the same 18 stretches after a low-pass of 4 Hz, each pass
FALL_BY_LOG = 2.45  # how it grows with the logarithm of the cutoff, from 4 to 8 Hz
FALL_STD = 0.9  # from one of them to the next
LEAST_NATS = -1.0
TAILS_DOF = 8.0  # of Student's t: sound ones stray, too
LEAST_S = 0.08  # of a contact that is judged
LEAST_PEAK_N = 200.0  # likewise
SEEN = 0.5  # share of an edge's frames that lie far enough from the ends


def fall_off(vertical_N: Float[np.ndarray, " samples"], rate: float) -> list[float]:
    """Logarithm of the amplitude at 20 Hz over that at 8 Hz, for each edge of each contact.

    Args:
        vertical_N: of one plate, gaps bridged, positive while loaded.
        rate: samples per second [Hz]; below 50 nothing is told.
    """
    reach = round(REACH_S * rate)
    if rate < 2.5 * QUICK_HZ or len(vertical_N) < 2 * reach + 5:
        return []
    slow, quick = (_amplitude(vertical_N, rate, f_Hz) for f_Hz in (SLOW_HZ, QUICK_HZ))
    near, found = round(NEAR_S * rate), []
    for start, end in runs(vertical_N > CONTACT_N):
        if end - start < LEAST_S * rate or vertical_N[start:end].max() < LEAST_PEAK_N:
            continue
        for edge in (start, end):
            around = slice(max(0, edge - near), edge + near)
            known = np.isfinite(slow[around])
            if 0 < edge < len(vertical_N) and known.mean() > SEEN:
                found.append(float(np.log(quick[around][known].max() / slow[around][known].max())))
    return found


def usual_fall_off(each: Iterable[float]) -> float | None:
    """The median; None where no contact begins or ends within the recording."""
    known = list(each)
    return float(np.median(known)) if known else None


def filtered_nats(fall: float) -> float:
    """How much likelier such a fall is after a low-pass at 4 to 8 Hz than of forces as they are [nats].

    That a spectrum falls slowly says little: files whose contacts were cut off after filtering have edges.
    """
    nats = log_t(fall - FILTERED, FILTERED_STD, TAILS_DOF) - log_t(fall - SOUND, SOUND_STD, TAILS_DOF)
    return max(nats, LEAST_NATS)


def log_cutoff(fall: float) -> tuple[float, float] | None:
    """What such a fall says of the logarithm of a filter's cutoff [Hz]; None where it speaks for none.

    Returns:
        Mean and standard deviation, which is the scatter between persons.
    """
    if filtered_nats(fall) <= 0:
        return None
    return float(np.log(FALL_OF_4_HZ[0]) + (fall - FALL_OF_4_HZ[1]) / FALL_BY_LOG), FALL_STD / FALL_BY_LOG


def _amplitude(
    vertical_N: Float[np.ndarray, " samples"], rate: float, frequency_Hz: float
) -> Float[np.ndarray, " samples"]:
    """Of what is at a frequency, about each sample [N]; NaN near the ends.

    Of the second differences, divided by the frequency squared again: nothing slow leaks in.
    """
    reach = round(REACH_S * rate)
    window = blackmanharris(2 * reach + 1)
    wave = np.exp(2j * np.pi * frequency_Hz * np.arange(-reach, reach + 1) / rate) * window / window.sum()
    bend = np.diff(vertical_N, 2) * (rate / (2 * np.pi * frequency_Hz)) ** 2
    amplitude = np.full(len(vertical_N), np.nan)
    amplitude[reach + 1 : len(vertical_N) - reach - 1] = 2 * np.abs(np.convolve(bend, wave, mode="valid"))
    return amplitude + 1e-12
