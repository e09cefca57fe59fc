"""Filter mismatch: the forces were smoothed before they were exported, the markers less, or as much."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.plates.conditioning import contact_samples
from solver.common.true_runs import runs
from solver.common.white_noise import white_noise
from solver.diagnosis.causes.about import About, Entry, Reading
from solver.diagnosis.causes.contact_edges import fall_off, filtered_nats, log_cutoff, usual_fall_off
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, Signature
from solver.diagnosis.causes.observed_trial import PlateScene, Scene

STARTS_HZ = (2.0, 2.5, 3.2, 4.0, 5.0, 6.3, 8.0, 10.0, 12.5, 16.0, 20.0)  # a quarter apart
PRIOR_HZ = 10.0  # laboratories smooth at 6 to 20 Hz if at all
PRIOR_LOG_STD = 0.5
LOWEST_HZ = 1.5
HIGHEST_HZ = 25.0  # little below the band that forces and kinematics share
LEAST_HARM_HZ = 18.0  # smoothing above takes off a tenth of what markers can tell
ORDER = 2  # of the single pass
FITTED_PERIODS = 0.05  # over which value and slope at the end of a contact are read
SURELY_LOADED = 1.5  # times the contact threshold: with less, many a program writes no point
RATIO_STARTS = (1.0, 8.0)  # of the markers' cutoff to that of the forces: smoothed as much, or not at all
PRIOR_LOG_RATIO, PRIOR_LOG_RATIO_STD = (
    1.0,
    1.0,
)  # of it: from as much to next to nothing, each a deviation away
UNSETTLED_NATS = 2.0  # what two parameters that the data leave within their prior cost
CUT_OFF_STD = 0.03  # of the cutoff: where files cut off a smoothed contact's ends; by hidden effects
NOISE_N = 0.35  # of a plate's samples; with less, nothing is said against a filter
ROUNDING_SHARE = 0.6  # of the step between values of a file: what rounding alone can look like, as noise
SAME_N = 1e-6  # values nearer than that are one
TAKES_OFF = 10.0  # times, by which the gentlest of these filters makes less of noise that is not smoothed
MOST_GAIN = 20.0  # of the inverse: a newton of noise within its band grows to that


@dataclass(frozen=True)
class FilterMismatch(Candidate):
    """The forces were low-passed (Butterworth, 2nd order, forwards and backwards), the markers less.

    η is the logarithm of the cutoff, and, where the contacts' edges speak for a filter, that of the markers'
    cutoff over it; elsewhere the markers are sharp. The measured side is sharpened by H/(H² + ε²), H the
    filter's gain: by 1/H where that is small, by 20 at most, and by little beyond, where the signal is lost.
    Half of it comes back where H = 1/40, at 15 Hz for a cutoff of 6. Then it is smoothed as the markers were,
    never more than the forces: so it cannot pay by smoothing.

    The forces show a filter by themselves as well, in how steeply their spectrum falls where contacts begin
    and end (`contact_edges.py`). Where the markers were smoothed as much, nothing else does.
    """

    fall: float | None = None  # of that spectrum; None where no contact begins or ends

    about = About(
        id="filter_mismatch",
        entry=Entry(
            "`all`",
            "forces were low-passed (2nd order, zero phase), markers less or as much",
            "`cutoff_Hz` (of each pass)",
        ),
        title="smoothed forces",
        sentence="The forces were smoothed before they were exported: impacts are blunted.",
        remedy=(
            "Export the forces unfiltered. If they have to be smoothed, filter markers and forces "
            "with the same cutoff, and take peaks and impacts from neither."
        ),
        separate_by="the same trial exported without a filter",
        branch="time/filter",
        odds_against=3.0,
        less_at_first=3.0,  # edges of 39 sound stretches say 0.7 nats for it at most, filtered ones 4 to 8
        readings=(Reading("cutoff_Hz", "smoothed with a low-pass filter at {amount}", "Hz"),),
    )

    @property
    def seen_elsewhere(self) -> float:
        """What the contacts' edges say for a filter; against one they say too little."""
        return 0.0 if self.fall is None else max(0.0, filtered_nats(self.fall))

    @property
    def less_at_first(self) -> float:
        """Less where the edges speak: a cutoff and a ratio that the balance does not tell take some of it."""
        return self.about.less_at_first + (UNSETTLED_NATS if self._edges_speak else 0.0)

    @property
    def _edges_speak(self) -> bool:
        return self.seen_elsewhere > 0

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Logarithms of cutoffs [Hz], with sharp markers and with markers that were smoothed as much."""
        cutoffs = [float(np.log(cutoff)) for cutoff in STARTS_HZ]
        if not self._edges_speak:
            return tuple((cutoff,) for cutoff in cutoffs)
        return tuple((cutoff, float(np.log(ratio))) for ratio in RATIO_STARTS for cutoff in cutoffs)

    def prior(self, scenes: Sequence[Scene]) -> tuple[tuple[float, float], ...]:
        """Around the cutoffs in use, and what the contacts' edges say of it."""
        usual = float(np.log(PRIOR_HZ)), PRIOR_LOG_STD
        by_edges = None if self.fall is None else log_cutoff(self.fall)
        if by_edges is None:
            return (usual,)
        weights = np.array([usual[1], by_edges[1]]) ** -2.0
        mean = float(weights @ [usual[0], by_edges[0]] / weights.sum())
        return (mean, float(weights.sum() ** -0.5)), (PRIOR_LOG_RATIO, PRIOR_LOG_RATIO_STD)

    def steps(self) -> Eta:
        """A tenth of the cutoff; a fifth of the ratio."""
        return (0.1, 0.2) if self._edges_speak else (0.1,)

    def admissible(self, eta: Eta) -> bool:
        """Within what filters of forces are set to, and the markers not smoothed more."""
        within = np.log(LOWEST_HZ) <= eta[0] <= np.log(HIGHEST_HZ)
        return bool(within and all(0 <= ratio <= np.log(RATIO_STARTS[-1]) for ratio in eta[1:]))

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The sharpened recording, smoothed as the markers were, less the recording."""
        if not any(plate.loaded.any() for plate in scene.plates):
            return None
        cutoff_Hz = float(np.exp(eta[0]))
        fixed = -scene.measured_ground
        for plate in scene.plates:
            alike = recorded_as_if_sharp(plate, cutoff_Hz)
            for log_ratio in eta[1:]:
                alike = blunt(alike, plate.plate.rate, cutoff_Hz * float(np.exp(log_ratio)))
            fixed = fixed + np.nan_to_num(plate.at_frames(alike))
        return Signature.of_fixed(fixed)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """cutoff_Hz."""
        cutoff_Hz = float(np.exp(fit.eta[0]))
        return {"cutoff_Hz": Estimate(cutoff_Hz, cutoff_Hz * float(np.hypot(fit.eta_std[0], CUT_OFF_STD)))}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Below what leaves the forces of walking as they are."""
        return estimates["cutoff_Hz"].value < LEAST_HARM_HZ

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One filter for all plates; none where a plate's samples hold noise that it would have taken off."""
        plates = [plate for scene in scenes for plate in scene.plates]
        if not any(plate.loaded.any() for plate in plates) or any(map(shows_no_filter, plates)):
            return []
        edges = [fall for p in plates for fall in fall_off(p.loads.raw_ground[:, 1], p.plate.rate)]
        return [cls("all", usual_fall_off(edges))]


def shows_no_filter(plate: PlateScene) -> bool:
    """Whether its loaded samples change from one to the next by more than a smoothed force can."""
    vertical_N, carrying = plate.loads.raw_ground[:, 1:2], plate.loads.carrying[:, None]
    noise_N, left_N = (
        float(white_noise(np.where(carrying, samples, np.nan))[0])
        for samples in (vertical_N, blunt(vertical_N, plate.plate.rate, HIGHEST_HZ))
    )
    apart_N = np.diff(np.unique(vertical_N[carrying]))
    step_N = float(apart_N[apart_N > SAME_N].min(initial=np.inf))
    return noise_N > max(NOISE_N, ROUNDING_SHARE * step_N, TAKES_OFF * left_N)


def recorded_as_if_sharp(plate: PlateScene, cutoff_Hz: float) -> Float[np.ndarray, "samples 6"]:
    """The plate's samples with the filter undone, and then set to zero while unloaded like any recording.

    Without that last step the samples below the contact threshold would count here and not in the null.
    """
    rate = plate.plate.rate
    raw = plate.loads.raw_ground
    writes_zeros = not raw.any(axis=1).all()  # without load; the point may have gone before the force
    if writes_zeros:
        sure = raw[:, 1] > SURELY_LOADED * plate.conditioning.threshold_N
        raw = np.where(sure[:, None], raw, 0.0)
    whole = with_tails(raw, rate, cutoff_Hz)
    near = near_contact(plate, 1 / cutoff_Hz)
    sharp = sharpen(np.where(near[:, None], whole, 0.0), rate, cutoff_Hz)
    loaded = contact_samples(replace(plate.plate, force_ground=sharp[:, :3]), plate.conditioning)
    return np.where((loaded & plate.loads.recorded)[:, None], sharp, 0.0)


def near_contact(plate: PlateScene, reach_s: float) -> Bool[np.ndarray, " samples"]:
    """Contacts and so much before and after; within one period of the cutoff tails fall to a hundredth."""
    reach = int(np.ceil(plate.plate.rate * reach_s))
    near = np.zeros(plate.plate.samples, dtype=bool)
    for start, end in runs(plate.loads.carrying):
        near[max(start - reach, 0) : end + reach] = True
    return near


def with_tails(
    values: Float[np.ndarray, "samples columns"], rate: float, cutoff_Hz: float
) -> Float[np.ndarray, "samples columns"]:
    """Tails that were set to zero below a threshold, put back.

    Beyond a contact the filter rings down freely: its output is exp(−σt)(A cos σt + B sin σt) with the poles
    of the 2nd order, σ = 2πc/√2, and A, B follow from value and slope where the samples were cut off. Before
    a contact likewise, backwards.

    Args:
        values: smoothed, one row a sample; zeros where unloaded.
        rate: of the samples [Hz].
        cutoff_Hz: of the single pass [Hz].
    """
    fitted = max(4, round(FITTED_PERIODS * rate / cutoff_Hz))
    decay = 2 * np.pi * cutoff_Hz / np.sqrt(2)
    tau = np.arange(1, int(np.ceil(rate / cutoff_Hz)) + 1)[:, None] / rate
    written = np.asarray(values.any(axis=1))
    whole = values.copy()
    for start, end in runs(written):
        if end - start < 2 * fitted:
            continue
        for edge, outwards in ((end - 1, 1), (start, -1)):
            known = values[edge - outwards * np.arange(fitted)]
            _, slope, value = np.polyfit(-np.arange(fitted) / rate, known, 2)
            tail = np.exp(-decay * tau) * (
                np.cos(decay * tau) * value + np.sin(decay * tau) * (slope / decay + value)
            )
            place = edge + outwards * np.arange(1, len(tau) + 1)
            inside = (place >= 0) & (place < len(values))
            inside[inside] = ~written[place[inside]]
            whole[place[inside]] += tail[inside]
    return whole


def blunt(
    values: Float[np.ndarray, "samples columns"], rate: float, cutoff_Hz: float
) -> Float[np.ndarray, "samples columns"]:
    """The zero-phase filter along the first axis; nothing where it lets pass all that is sampled.

    Args:
        values: one row a sample.
        rate: of the samples [Hz].
        cutoff_Hz: of the single pass [Hz].
    """
    if cutoff_Hz >= 0.5 * rate:
        return values
    return _through(values, rate, cutoff_Hz, lambda gain: gain)


def sharpen(
    values: Float[np.ndarray, "samples columns"], rate: float, cutoff_Hz: float
) -> Float[np.ndarray, "samples columns"]:
    """The bounded inverse of the zero-phase filter along the first axis.

    Args:
        values: smoothed, one row a sample.
        rate: of the samples [Hz].
        cutoff_Hz: of the single pass [Hz].
    """

    def inverse(gain: Float[np.ndarray, " frequencies"]) -> Float[np.ndarray, " frequencies"]:
        bounded = gain / (gain**2 + (0.5 / MOST_GAIN) ** 2)
        return np.asarray(bounded / bounded[0])

    return _through(values, rate, cutoff_Hz, inverse)


def _through(
    values: Float[np.ndarray, "samples columns"],
    rate: float,
    cutoff_Hz: float,
    gain_to: Callable[[Float[np.ndarray, " frequencies"]], Float[np.ndarray, " frequencies"]],
) -> Float[np.ndarray, "samples columns"]:
    """Samples times something made of the filter's gain at each frequency."""
    reach = min(int(np.ceil(2 * rate / cutoff_Hz)), len(values) - 1)
    before = 2 * values[0] - values[reach:0:-1]
    after = 2 * values[-1] - values[-2 : -2 - reach : -1]
    extended = np.concatenate([before, values, after])
    gain = zero_phase_gain(np.fft.rfftfreq(len(extended), 1 / rate), rate, cutoff_Hz)
    spectrum = np.fft.rfft(extended, axis=0) * gain_to(gain)[:, None]
    return np.fft.irfft(spectrum, len(extended), axis=0)[reach : reach + len(values)]


def zero_phase_gain(
    frequency_Hz: Float[np.ndarray, " frequencies"], rate: float, cutoff_Hz: float
) -> Float[np.ndarray, " frequencies"]:
    """Of the digital Butterworth filter run forwards and backwards: 1/(1 + (tan(πf/r)/tan(πc/r))^(2n))."""
    warped = np.tan(np.pi * np.minimum(frequency_Hz / rate, 0.4999)) / np.tan(np.pi * cutoff_Hz / rate)
    return np.asarray(1 / (1 + warped ** (2 * ORDER)))
