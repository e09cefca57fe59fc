"""Which short trial would tell the likeliest causes apart, and by how much.

Each hypothesis (a name, a rival in its place, nothing, something on no list) was fitted to the present
trials: it has a posterior of its parameters, and of all that a sound recording may be off by. With a short
trial's columns that predicts the trial's balance as a Gaussian. What the trial will say for hypothesis a
against b, if a is right, is expected to be

    D(a, b) = ½ [tr(V_b⁻¹ V_a) − n + (m_a − m_b)ᵀ V_b⁻¹ (m_a − m_b) + log det V_b − log det V_a]    nats

The best trial leaves the right one the largest share, averaged over which of them is right; nats are tempered
as in the diagnosis of all trials, the more the more is explained.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.lapack import dpotri
from scipy.special import softmax

from solver.diagnosis.causes.effect import Eta
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.deciding.short_trials import ShortTrial, can_move, short_trials
from solver.diagnosis.diagnosis import ToBeSure
from solver.diagnosis.noise.balance_rows import END_S, WINDOW_S, TrialRows
from solver.diagnosis.noise.model_errors import model_error, nuisances, soft_tissue
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.search.balance import Balance, laboratory_errors
from solver.diagnosis.search.contenders import TEMPER_NATS, Found
from solver.diagnosis.search.refinement import SMALL_STEP
from solver.diagnosis.search.terms import Solved, Term
from solver.diagnosis.unmodelled.open_world import OUTSIDE_THE_LIST, TEMPER_SHARE, Held, Standing
from solver.dynamics.weighted_means import windows_over

SURE = 0.9  # of a name: nothing more needs to be recorded
LEAST_SHARE = 0.03  # of a hypothesis, to be heard
LEAST_NATS = 2.0  # that a trial has to promise against a rival, and the rival against the name
LEAST_GAINED = 0.05  # of the right one's share, likewise, on average
LEAST_COUNTED = 1e-6  # of a share
MOST_RIVALS = 3
NOTHING = "nothing"
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


def trial_to_be_sure(balance: Balance, held: Held) -> ToBeSure | None:
    """The short trial that is most likely to decide the least sure name that has a rival; None where all are.

    Args:
        balance: of all trials.
        held: the names, each among all that may be in its place.
    """
    unsure = [(one, s) for one, s in zip(held.found, held.standings, strict=True) if s.confidence < SURE]
    if not unsure or not can_move(present_of(balance)):
        return None
    one, standing = max(unsure, key=lambda pair: pair[1].confidence)
    some = hypotheses(balance, held.solved, one, standing)
    fitted = posteriors(balance, some)
    asked = best_of(expected(balance, fitted), some)
    return asked if asked is None else in_full(balance, fitted, asked)


def hypotheses(balance: Balance, solved: Solved, one: Found, standing: Standing) -> list[Hypothesis]:
    """The name, then all that may be in its place, the likeliest first.

    Args:
        balance: of all trials.
        solved: all names together.
        one: the name.
        standing: its share, and those of all else.
    """
    rest = [t for t in solved.terms if t is not one.contender.term]
    near = solved.noise_scale
    others = [
        Hypothesis(
            *(term := r.contender.term).candidate.key,
            r.share,
            r.temper,
            balance.solve_at([*rest, term], near),
        )
        for r in standing.rivals
        if r.share >= LEAST_SHARE
    ]
    if standing.strongest is not None and standing.outside >= LEAST_SHARE:
        unknown = standing.strongest
        terms = [*rest, unknown.likeliest.terms[-1]]
        words, share = unknown.cause.words, standing.outside
        with_it = balance.solve_at(terms, near)
        others.append(Hypothesis(OUTSIDE_THE_LIST, words, share, standing.temper, with_it))
    known = standing.confidence + standing.outside + sum(r.share for r in standing.rivals)
    without = balance.solve_at(rest, near)
    others.append(Hypothesis(NOTHING, "", max(0.0, 1.0 - known), standing.temper, without))
    name, there = one.contender.term.candidate.key, balance.solve_at(solved.terms, near)
    own = Hypothesis(*name, standing.confidence, TEMPER_NATS, there)
    likeliest = sorted(others, key=lambda h: -h.share)
    return [own, *(h for k, h in enumerate(likeliest) if k < MOST_RIVALS or h.id == NOTHING)]


@dataclass(frozen=True, eq=False)
class Posterior:
    """Of what sound recordings are off by, then of the terms' parameters: mean and covariance."""

    of: Hypothesis
    mean: Float[np.ndarray, " all"]
    covariance: Float[np.ndarray, "all all"]


@dataclass(frozen=True, eq=False)
class Expected:
    """What a short trial promises: nats for each hypothesis against each other, and their shares then."""

    trial: ShortTrial
    nats: Float[np.ndarray, "right other"]
    shares: Float[np.ndarray, "right other"]  # afterwards, if the first is right

    def share(self, some: Sequence[Hypothesis]) -> float:
        """Of the right one afterwards, averaged over which it is."""
        before = np.array([h.share for h in some])
        return float(before @ np.diag(self.shares) / before.sum())


def expected(balance: Balance, fitted: Sequence[Posterior]) -> list[Expected]:
    """What each short trial promises at least, by some of its windows; the best first.

    Args:
        balance: of all trials.
        fitted: hypotheses.
    """
    some = [p.of for p in fitted]
    about = [t for h in some for t in h.target.split("+")]
    found = [_expected(balance, fitted, trial) for trial in short_trials(present_of(balance), about)]
    return sorted((e for e in found if e is not None), key=lambda e: -e.share(some))


def in_full(balance: Balance, fitted: Sequence[Posterior], asked: ToBeSure) -> ToBeSure:
    """A proposal with the nats and odds of all windows of its trial; arguments as in `expected`."""
    if asked.trial is None:
        return asked
    key = asked.other_id, asked.other_target
    rival = next(p for p in fitted if (p.of.id, p.of.target) == key)
    few = [fitted[0], rival, *(p for p in fitted if p.of.id == NOTHING and p is not rival)]
    trials = short_trials(present_of(balance), asked.plates)
    trial = next(t for t in trials if (t.kind.id, t.plates) == (asked.trial, asked.plates))
    whole = _expected(balance, few, trial, in_full=True)
    if whole is None:
        return asked
    odds = float(whole.shares[0, 0] / max(whole.shares[0, 1], LEAST_COUNTED))
    nats, if_other = float(whole.nats[0, 1]), float(whole.nats[1, 0])
    return replace(asked, nats=nats, nats_if_other=if_other, odds_after=odds)


def _expected(
    balance: Balance, fitted: Sequence[Posterior], trial: ShortTrial, *, in_full: bool = False
) -> Expected | None:
    rows = rows_of_trial(balance, trial, present_of(balance), in_full=in_full)
    if rows is None:
        return None
    planned = planned_rows(balance, rows, fitted[0].of.solved.noise_scale)
    predictions = [predict(planned, posterior) for posterior in fitted]
    nats = np.array([[a.nats_against(b) for b in predictions] for a in predictions])
    return Expected(trial, nats, shares_after([p.of for p in fitted], nats))


def shares_after(
    some: Sequence[Hypothesis], nats: Float[np.ndarray, "right other"]
) -> Float[np.ndarray, "right other"]:
    """Of each hypothesis, if one of them is right: evidence counts less the more is explained by it.

    Args:
        some: hypotheses, the name first.
        nats: that a trial says for the first against the second.
    """
    tempers = np.array([h.temper for h in some])
    log_shares = np.log(np.maximum([h.share for h in some], LEAST_COUNTED))
    evidence = tempers * (log_shares - log_shares[0])
    nothing = [k for k, h in enumerate(some) if h.id == NOTHING]
    more = [TEMPER_SHARE * max(0.0, float(own[nothing].sum())) for own in nats]
    between = np.maximum.outer(tempers, tempers) + np.array(more)[:, None]
    return softmax((evidence - evidence[:, None] - nats) / between, axis=1)


def best_of(promised: Sequence[Expected], some: Sequence[Hypothesis]) -> ToBeSure | None:
    """The one to propose, its figures to come: none where nothing on the list helps; None without a rival.

    Args:
        promised: the best first.
        some: hypotheses, the name first and its strongest rival next.
    """
    name, rivals = some[0], [k for k, h in enumerate(some) if k and h.share >= LEAST_SHARE]
    if not rivals:
        return None
    shares = np.array([h.share for h in some])
    now = float((shares**2).sum() / shares.sum() ** 2)
    best, told = None, rivals[0]
    if promised and promised[0].share(some) >= now + LEAST_GAINED:
        nats = promised[0].nats
        parted = [k for k in rivals if min(nats[0, k], nats[k, 0]) >= LEAST_NATS]
        best, told = (promised[0], parted[0]) if parted else (None, told)
    rival = some[told]
    asked = ToBeSure(name.id, name.target, rival.id, rival.target, name.share / rival.share)
    if best is None:
        return asked
    return replace(
        asked,
        trial=best.trial.kind.id,
        plates=best.trial.plates,
        words=best.trial.words,
        share_after=best.share(some),
    )


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
    """A short trial's rows, their noise that of the present trial.

    Args:
        balance: of the present trials.
        trial: that could be recorded.
        present: one of its scenes.
        in_full: as many windows as a recording would have; half of them rank trials as well.
    """
    scene = trial.scene(present, in_full=in_full)
    if scene is None:
        return None
    counts = scene.counts.copy()
    ends = round(END_S * scene.rate)
    counts[:ends] = counts[len(counts) - ends :] = False
    own = next(t for t in balance.trials if t.scene is present)
    hop = _step(own) if in_full else _hop(own)
    windows = windows_over(counts, scene.rate, WINDOW_S, hop / present.rate)
    if not windows.count:
        return None
    nothing = np.zeros((0, 0))
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


@dataclass(frozen=True, eq=False)
class Planned:
    """A short trial's rows, and what all hypotheses share of them, whitened by what is the trial's own."""

    rows: TrialRows
    root: Float[np.ndarray, "rows rows"]  # lower, of the trial's own covariance
    shared: Float[np.ndarray, "rows shared"]


def planned_rows(balance: Balance, rows: TrialRows, noise_scale: NoiseScale) -> Planned:
    """Rows of a short trial at the noise scale of the present ones."""
    laboratory = laboratory_errors([rows], balance.scenes)
    shared = np.concatenate([rows.nuisance, laboratory, noise_scale.slack * rows.tissue], axis=1)
    root = cholesky(rows.covariance + noise_scale.scale**2 * rows.model_error, lower=True)
    return Planned(rows, root, solve_triangular(root, shared, lower=True))


def predict(planned: Planned, posterior: Posterior) -> Prediction:
    """A short trial's balance as a hypothesis expects it.

    Args:
        planned: the short trial.
        posterior: of the hypothesis.
    """
    of, fixed, parts = posterior.of, np.zeros(len(planned.root)), [planned.shared]
    for k, term in enumerate(of.solved.terms):
        own_fixed, columns = _columns(planned.rows, term, of.solved, k)
        own = solve_triangular(planned.root, np.column_stack([columns, own_fixed]), lower=True)
        fixed += own[:, -1]
        parts.append(own[:, :-1])
    G = np.concatenate(parts, axis=1)
    covariance = np.eye(len(fixed)) + G @ posterior.covariance @ G.T
    root = cholesky(covariance, lower=True)
    lower = np.tril(dpotri(root, lower=1)[0])
    precision = lower + np.tril(lower, -1).T
    log_det = 2.0 * float(np.log(np.diag(root)).sum())
    return Prediction(fixed + G @ posterior.mean, covariance, precision, log_det)


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
