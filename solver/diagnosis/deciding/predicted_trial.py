"""What a short trial's balance, or a scale's reading, would be, by each hypothesis: Gaussians.

A hypothesis was fitted to the present trials: it has a posterior of its parameters, and of all that a sound
recording may be off by. A short trial's columns carry it over; the rest is the trial's own noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.lapack import dpotri

from solver.diagnosis.causes.effect import Eta
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.deciding.short_trials import SCALE, ShortTrial
from solver.diagnosis.noise.balance_rows import END_S, WINDOW_S, TrialRows, readings_noise, scale_rows
from solver.diagnosis.noise.model_errors import model_error, nuisances, soft_tissue, unseen_posture
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.scenes import noise_of_markers
from solver.diagnosis.search.balance import Balance, laboratory_errors
from solver.diagnosis.search.refinement import SMALL_STEP
from solver.diagnosis.search.terms import Solved, Term
from solver.dynamics.force_prediction.marker_posterior import trial_posterior
from solver.dynamics.weighted_means import Windows, windows_over
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.skeleton.forward import marker_positions

LEAST_VARIANCE = 1e-9  # of its mean, on the diagonal of an averaged covariance: rounding


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """What may be wrong, as it was fitted to the present trials."""

    id: str
    target: str
    share: float
    temper: float  # nats that count as one between it and the name; of the name the least
    solved: Solved


@dataclass(frozen=True, eq=False)
class Prediction:
    """Of a short trial's balance, by one hypothesis: whitened by what is the trial's own."""

    mean: Float[np.ndarray, " rows"]
    covariance: Float[np.ndarray, "rows rows"]
    precision: Float[np.ndarray, "rows rows"]  # its inverse
    log_det: float  # of the covariance

    def nats_against(self, other: "Prediction") -> float:
        """What the trial is expected to say for this one against another, if this one is right."""
        apart = self.mean - other.mean
        spread = float((other.precision * self.covariance).sum()) - len(apart)
        return 0.5 * (spread + float(apart @ other.precision @ apart) + other.log_det - self.log_det)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Of what sound recordings are off by, then of the terms' parameters: mean and covariance."""

    of: Hypothesis
    mean: Float[np.ndarray, " all"]
    covariance: Float[np.ndarray, "all all"]


def present_of(balance: Balance) -> Scene:
    """The longest trial stands for all."""
    return max(balance.scenes, key=lambda s: int(s.counts.sum()))


def posteriors(balance: Balance, some: Sequence[Hypothesis]) -> list[Posterior]:
    """Of each hypothesis, all fitted at one noise scale."""
    noise_scale, of = some[0].solved.noise_scale, balance.basis.of
    shared = np.concatenate([of.shared, noise_scale.slack * of.tissue], axis=1)
    seen = noise_scale.whiten(balance.basis.transform(shared))
    within = seen.T @ seen
    return [_posterior(seen, within, h) for h in some]


def _posterior(
    seen: Float[np.ndarray, "rows shared"], within: Float[np.ndarray, "shared shared"], hypothesis: Hypothesis
) -> Posterior:
    """With Q = I + B P Bᵀ in whitened rows: mean Λ Gᵀ Q⁻¹ y, covariance Λ − Λ Gᵀ Q⁻¹ G Λ."""
    solved = hypothesis.solved
    own = [t.whiten(solved.noise_scale)[1] for t in solved.terms]
    B = np.concatenate([np.zeros((len(seen), 0)), *own], axis=1) * solved.std
    G = np.concatenate([seen, B], axis=1)
    across = seen.T @ B
    inside = np.block([[within, across], [across.T, B.T @ B]])
    gain = solve_triangular(solved.root, B.T @ G, lower=True) if B.shape[1] else np.zeros((0, G.shape[1]))
    scale = np.concatenate([np.ones(seen.shape[1]), solved.std])
    covariance = (np.eye(len(scale)) - inside + gain.T @ gain) * np.outer(scale, scale)
    return Posterior(hypothesis, scale * (G.T @ solved.left), covariance)


def rows_of_trial(
    balance: Balance, trial: ShortTrial, present: Scene, *, in_full: bool = False
) -> TrialRows | None:
    """A short trial's rows, or a scale's; who walks has the present trial's noise.

    Args:
        balance: of the present trials.
        trial: that could be recorded.
        present: one of its scenes.
        in_full: as many windows as a recording would have; half of them rank trials as well.
    """
    own = next(t for t in balance.trials if t.scene is present)
    if trial.kind is SCALE:
        return scale_rows(own, balance.settings)
    scene = trial.scene(present, in_full=in_full)
    if scene is None:
        return None
    counts = scene.counts.copy()
    ends = round(END_S * scene.rate)
    counts[:ends] = counts[len(counts) - ends :] = False
    hop = _step(own) if in_full else _hop(own)
    windows = windows_over(counts, scene.rate, WINDOW_S, hop / present.rate)
    if not windows.count:
        return None
    nothing = np.zeros((0, 0))
    if trial.plates:
        covariance = _noise_standing(own, scene, windows, balance.settings)
    else:
        covariance = _noise(own, np.round(windows.start / scene.rate * present.rate / hop).astype(int), hop)
    rows = TrialRows(scene, windows, covariance, nothing, nothing, nothing, np.zeros(0))
    settings = balance.settings
    return replace(
        rows,
        model_error=model_error(scene, windows),
        nuisance=nuisances(scene, rows.reduce, settings),
        tissue=soft_tissue(scene, rows.reduce, settings),
    )


def _step(own: TrialRows) -> int:
    """Frames between the present trial's windows."""
    return int(np.diff(own.windows.start).min()) if own.windows.count > 1 else 1


def _hop(own: TrialRows) -> int:
    """A whole number of these, about a window's length."""
    step = _step(own)
    return step * max(1, round(WINDOW_S * own.scene.rate / step))


def _noise(own: TrialRows, at: Int[np.ndarray, " windows"], hop: int) -> Float[np.ndarray, "rows rows"]:
    """Covariance by the time between windows, as the present trial's is on average.

    Args:
        own: of the present trial.
        at: when each window begins, in hops.
        hop: frames of the present trial.
    """
    C = own.covariance.reshape(own.windows.count, 6, own.windows.count, 6).transpose(0, 2, 1, 3)
    lag = own.windows.start[None, :] - own.windows.start[:, None]
    found = np.stack([C[lag == k * hop].sum(axis=0) for k in range(int(np.ptp(at)) + 1)])
    lags = at[None, :] - at[:, None]
    there = found[np.abs(lags)]
    blocks = np.where((lags >= 0)[..., None, None], there, there.transpose(0, 1, 3, 2)) / own.windows.count
    whole = blocks.transpose(0, 2, 1, 3).reshape(6 * len(at), -1)
    return np.asarray(whole + LEAST_VARIANCE * np.trace(whole) / len(whole) * np.eye(len(whole)))


def _noise_standing(
    own: TrialRows, scene: Scene, windows: Windows, settings: DiagnosisSettings
) -> Float[np.ndarray, "rows rows"]:
    """Covariance of a quiet motion's rows, of which markers that err as in the present trial tell much more.

    Half a turn changes but signs across axes, and is left out.

    Args:
        own: of the present trial.
        scene: of the short one.
        windows: of it.
        settings: of the diagnosis.
    """
    present, skeleton, motion = own.scene, scene.skeleton, scene.motion
    error = (present.markers.observed_ground - present.markers.model_ground)[present.counts]
    errors = np.concatenate([error, error[-2:0:-1]])  # there and back
    at = round(present.rate / scene.rate) * np.arange(scene.frames) % len(errors)
    observed = marker_positions(skeleton, motion.q) + errors[at]
    noise = replace(noise_of_markers(skeleton, settings), iterations=1)
    posterior = trial_posterior(skeleton, observed, motion, noise, present.trajectory_settings)
    covariance = posterior.wrench_covariance(scene.measured_ground, windows) + unseen_posture(scene, windows)
    of_window, each = np.arange(windows.count), covariance.reshape(windows.count, 6, windows.count, 6)
    each[of_window, :, of_window] += readings_noise(present, own.windows, settings).mean(axis=0)
    return covariance


@dataclass(frozen=True, eq=False)
class Planned:
    """What a short trial tells, and what all hypotheses share of it, whitened by what is the trial's own."""

    rows: TrialRows
    root: Float[np.ndarray, "rows rows"]  # lower, of the trial's own covariance
    of_all: Float[np.ndarray, "rows shared"]  # columns

    @cached_property
    def shared(self) -> Float[np.ndarray, "own shared"]:
        """Whitened."""
        return self.whiten(self.of_all)

    def whiten(self, columns: Float[np.ndarray, "rows some"]) -> Float[np.ndarray, "own some"]:
        """By what is the trial's own."""
        return np.asarray(solve_triangular(self.root, columns, lower=True))

    def turned(self, prediction: Prediction, planned: "Planned") -> Prediction:
        """Mean and covariance of one that was whitened at another noise scale, whitened at this one."""
        turn = self.whiten(planned.root)
        log_det = prediction.log_det + 2.0 * float(np.log(np.diag(turn)).sum())
        covariance = turn @ prediction.covariance @ turn.T
        return replace(prediction, mean=turn @ prediction.mean, covariance=covariance, log_det=log_det)


def planned_rows(balance: Balance, rows: TrialRows, noise_scale: NoiseScale) -> Planned:
    """Rows of a short trial at the noise scale of the present ones."""
    laboratory = laboratory_errors([rows], balance.scenes)
    of_all = np.concatenate([rows.nuisance, laboratory, noise_scale.slack * rows.tissue], axis=1)
    root = cholesky(rows.covariance + noise_scale.scale**2 * rows.model_error, lower=True)
    return Planned(rows, root, of_all)


def predict(planned: Planned, posterior: Posterior) -> Prediction:
    """A short trial's balance as a hypothesis expects it.

    Args:
        planned: the short trial.
        posterior: of the hypothesis.
    """
    of, fixed, parts = posterior.of, np.zeros(len(planned.shared)), [planned.shared]
    for k, term in enumerate(of.solved.terms):
        own_fixed, columns = _columns(planned.rows, term, of.solved, k)
        own = planned.whiten(np.column_stack([columns, own_fixed]))
        fixed += own[:, -1]
        parts.append(own[:, :-1])
    G = np.concatenate(parts, axis=1)
    covariance = np.eye(len(fixed)) + G @ posterior.covariance @ G.T
    root = cholesky(covariance, lower=True)
    lower = np.tril(dpotri(root, lower=1)[0])
    precision = lower + np.tril(lower, -1).T
    log_det = 2.0 * float(np.log(np.diag(root)).sum())
    return Prediction(fixed + G @ posterior.mean, covariance, precision, log_det)


def nats_between(
    balance: Balance, rows: TrialRows, fitted: Sequence[Posterior], *, at_own_scales: bool
) -> Float[np.ndarray, "right other"]:
    """Nats for each hypothesis against each other.

    Args:
        balance: of the present trials.
        rows: of the short one.
        fitted: hypotheses, all at one noise scale.
        at_own_scales: the other's noise scale is fitted to the short trial as well: a larger one hides what
            sets them apart, at the cost of evidence of the present trials.
    """
    near = fitted[0].of.solved.noise_scale
    here = planned_rows(balance, rows, near)
    right = [predict(here, p) for p in fitted]
    least = np.array([[a.nats_against(b) for b in right] for a in right])
    if not at_own_scales:
        return least
    scales = [s for s in balance.noise_scales if s.slack == near.slack and s.scale >= near.scale]
    for scale in sorted(scales, key=lambda s: s.scale)[2::2]:  # twice as large each time
        some = [replace(p.of, solved=balance.solve_at(p.of.solved.terms, scale)) for p in fitted]
        kept = [h.solved.log_evidence - p.of.solved.log_evidence for p, h in zip(fitted, some, strict=True)]
        there = planned_rows(balance, rows, scale)
        others = [predict(there, p) for p in posteriors(balance, some)]
        turned = [there.turned(a, here) for a in right]
        nats = np.array([[a.nats_against(b) for b in others] for a in turned]) - kept
        if (nats >= least).all():
            break
        least = np.minimum(least, nats)
    return least


def _columns(
    rows: TrialRows, term: Term, solved: Solved, k: int
) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, "rows parameters"]]:
    """A term's fixed part and columns in a short trial, derivatives by η last; zero where it is not there.

    What happens at a moment of the present trial, or changes in any way, says nothing of another.
    """
    n, width = len(rows.residual), term.columns.shape[1]
    linear = width - len(term.tangent_mean)
    nothing = np.zeros(n), np.zeros((n, width))
    candidate = term.candidate
    if candidate.about.free or candidate.about.at_certain_frames:
        return nothing

    def at(eta: Eta) -> tuple[np.ndarray, np.ndarray] | None:
        found = rows.rows_of(candidate, eta)
        if found is None or found.columns.shape[1] != linear:
            return None
        return (np.zeros(n) if found.fixed is None else found.fixed), found.columns

    here = at(term.eta)
    if here is None:
        return nothing
    x = solved.of(k)[0][:linear]
    tangents = []
    for i, step in enumerate(SMALL_STEP * np.array(candidate.steps()) if term.tangent_mean else ()):
        ends = [tuple(v + sign * step * (j == i) for j, v in enumerate(term.eta)) for sign in (1, -1)]
        high, low = (e if candidate.admissible(e) else term.eta for e in ends)
        (up, up_columns), (down, down_columns) = at(high) or here, at(low) or here
        tangents.append((up - down + (up_columns - down_columns) @ x) / ((high[i] - low[i]) or np.inf))
    T = np.stack(tangents, axis=1) if tangents else np.zeros((n, 0))
    away = np.array(term.tangent_mean) - np.array(term.eta) if tangents else np.zeros(0)
    return here[0] + T @ away, np.concatenate([here[1], T], axis=1)
