"""Exchange between plates: on two feet, what one gains the other loses, but for what motion asks for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from solver.common.runs import runs
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.statement import About, Statement, nats_of

DIRECT_CHECK = "exchange between plates"
LEAST_SHIFT_N = 3.0  # root mean square of what goes to and fro; less is the plates' own noise


@dataclass(frozen=True)
class Exchange:
    """Between two plates of one trial, on both feet."""

    one: str  # "plate_1"
    other: str
    share: float  # newtons that the other loses for each that the one gains
    std: float

    def log_share(self, factors: Mapping[str, float]) -> float:
        """If the plates read so many times what is true."""
        return float(np.log(self.share * factors.get(self.one, 1.0) / factors.get(self.other, 1.0)))


def exchange(trials: Sequence[Measured]) -> list[Statement]:
    """Of the longest stretch of each trial in which the same two plates bear all, and no seat beside."""
    return [_said(trial, found) for trial in trials if (found := exchange_of(trial)) is not None]


def exchange_of(trial: Measured) -> Exchange | None:
    """None where nobody stands on two plates for long enough, or moves no load between them."""
    settings = trial.settings
    known = np.isfinite(trial.vertical_N).all(axis=1) & np.isfinite(trial.acceleration)
    sizes = np.abs(trial.vertical_N).sum(axis=1)  # of whatever sign, which is what is asked about
    if not known.any():
        return None
    with np.errstate(invalid="ignore"):
        known &= sizes > settings.standing_share * np.percentile(sizes[known], 90)
    with np.errstate(invalid="ignore"):
        loaded = np.abs(trial.vertical_N) > settings.loaded_N
    stretch = _longest_on_two(loaded & known[:, None])
    if stretch is None or (stretch[1] - stretch[0]) / trial.rate < settings.standing_s:
        return None
    start, end = stretch
    used = np.flatnonzero(loaded[start])
    one, other = trial.vertical_N[start:end, used].T
    found = _shared(one, other, trial.acceleration[start:end], trial.rate * settings.window_s)
    return None if found is None else Exchange(f"plate_{used[0] + 1}", f"plate_{used[1] + 1}", *found)


def _said(trial: Measured, found: Exchange) -> Statement:
    settings, share, std = trial.settings, found.share, found.std
    names = [trial.capture.plates[int(t.split("_")[1]) - 1].name for t in (found.one, found.other)]
    if share > 0:
        nats = nats_of(float(np.log(share)), std / share, settings.exchange_scatter, settings.exchange_usual)
        against_sign = nats_of(share, std, 0.3, 1.0) if share < 2 * std else -10.0
    else:
        nats, against_sign = -1.0, 0.5 * (share / std) ** 2
    return Statement(
        DIRECT_CHECK,
        f"On both feet {names[1]} loses {share:.2f} ± {std:.2f} N for each newton that {names[0]} gains "
        "(normal: 1, within 0.1).",
        {About.PLATE_SCALE: nats, About.PLATE_SIGN: min(against_sign, 50.0)},
        {"share": share, "share_std": std},
        trial=trial.capture.name,
        target=f"{found.one}+{found.other}",
    )


def _longest_on_two(loaded: Bool[np.ndarray, "frames plates"]) -> tuple[int, int] | None:
    """The longest stretch in which the same two plates are loaded, and no other."""
    found = []
    for pair in np.unique(loaded[loaded.sum(axis=1) == 2], axis=0):
        found += runs((loaded == pair).all(axis=1))
    return max(found, key=lambda run: run[1] - run[0], default=None)


def _shared(
    one: np.ndarray, other: np.ndarray, acceleration: np.ndarray, window: float
) -> tuple[float, float] | None:
    """By how much the other falls for each newton of the one, motion taken out of both; with its error.

    Both readings err, so that the slope is that of the main axis of what is left.
    """
    design = np.stack([np.ones(len(one)), acceleration], axis=1)
    both = np.stack([one, other], axis=1)
    rest = both - design @ np.linalg.lstsq(design, both, rcond=None)[0]
    sizes, axes = np.linalg.eigh(rest.T @ rest / len(rest))
    if np.sqrt(sizes[1]) < LEAST_SHIFT_N or abs(axes[0, 1]) < 1e-3:
        return None
    share = -axes[1, 1] / axes[0, 1]
    independent = max(3.0, len(one) / max(window, 1.0))
    std = (
        (1 + share**2) * np.sqrt(max(sizes[0], 0.0) * sizes[1] / independent) / max(sizes[1] - sizes[0], 1e-9)
    )
    return float(share), float(max(std, 1e-3))
