"""The wrench balance of all trials as one Gaussian, and how likely it is with and without a cause.

r = required − measured, averaged over short windows, moments about the centre of mass. Its covariance
K(s, h) = markers' errors carried through the motion + plates' noise + inertias within what anthropometry
scatters (shared by trials) + plates a little off + h² soft tissue that slides with the joints + s² model
errors that last a tenth of a second. Candidates enter as columns with a Gaussian prior; all that the ordinary
fit can absorb is thereby projected out within its own prior. Every hypothesis, no cause included, has the
scales s and h that suit it best and pays for them through the determinant of K: none can win by shrinking the
noise. How far soft tissue slides differs between persons, and a recording of some seconds tells it.
"""

from collections.abc import Collection, Sequence
from copy import copy

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_solve, cholesky, solve_triangular

from solver.diagnosis.causes.catalogue import CAUSES
from solver.diagnosis.causes.effect import NO_PATHS, Candidate, Corrected, Eta, Paths
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.direct_checks.weight import Weighings
from solver.diagnosis.noise.balance_rows import TrialRows, scale_rows
from solver.diagnosis.noise.noise_grid import NoiseGrid
from solver.diagnosis.noise.noise_scales import Basis, Covariances, NoiseScale, Seen, TrialsBasis
from solver.diagnosis.search.terms import CandidateRows, Solved, Term, normal_equations
from solver.fitting.diagnosis_settings import DiagnosisSettings

MANY_ROWS = 1200  # from which on turning them pays


class Balance:
    """All trials' rows, a scale's reading after them, and the grid of noise scales of scales."""

    def __init__(self, trials: Sequence[TrialRows], settings: DiagnosisSettings) -> None:
        self.trials, self.settings = tuple(trials), settings
        self._scenes = tuple(t.scene for t in trials)
        scale = () if self._scenes[0].scale_factor is None else (scale_rows(trials[0], settings),)
        self._every = every = (*self.trials, *scale)
        self.start: Int[np.ndarray, " every+1"] = np.cumsum([0, *(len(t.residual) for t in every)])
        self.residual = np.concatenate([t.residual for t in every])
        self.mass = np.concatenate([t.mass for t in every])
        nuisance = np.concatenate([t.nuisance for t in every])
        of = Covariances(
            self.residual,
            fixed=tuple(t.covariance for t in every),
            model=tuple(t.model_error for t in every),
            shared=np.concatenate([nuisance, laboratory_errors(every, self._scenes)], axis=1),
            tissue=np.concatenate([t.tissue for t in every]),
        )
        self.basis = TrialsBasis(of) if len(self.residual) > MANY_ROWS else Basis(of)
        self.noise_grid = NoiseGrid(self.basis)
        self.noise_scales = self.noise_grid.noise_scales
        self.suspect: frozenset[str] = frozenset()
        self.weighings = Weighings()
        self.paths: Paths = NO_PATHS
        self.evaluations = 0.0  # rows fitted so far

    @property
    def is_exhausted(self) -> bool:
        """Whether a search has had as many evaluations as it may have."""
        return self.evaluations >= self.settings.most_evaluations

    def with_checks(
        self, suspect: Collection[str], weighings: Weighings, paths: Paths = NO_PATHS
    ) -> "Balance":
        """The same, with what direct checks say of it.

        Args:
            suspect: plates that are grossly wrong: nothing else is named beside that.
            weighings: of the person on each plate, which refute other units.
            paths: what each plate's path of pressure says of its turns.
        """
        other = copy(self)
        other.suspect, other.weighings, other.paths = frozenset(suspect), weighings, paths
        return other

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """Of the trials."""
        return self._scenes

    def rows_of(self, candidate: Candidate, eta: Eta) -> CandidateRows | None:
        """A candidate's rows at η, of the trials that it touches; None where it touches none."""
        parts = [t.rows_of(candidate, eta) for t in self._every]
        touched = [k for k, p in enumerate(parts) if p is not None]
        if not touched:
            return None
        span = slice(int(self.start[touched[0]]), int(self.start[touched[-1] + 1]))
        some = [parts[k] for k in touched]
        prior = next(p.prior_std for p in reversed(some) if p is not None)
        columns = np.zeros((span.stop - span.start, len(prior)))
        has_fixed = any(p is not None and p.fixed is not None for p in some)
        fixed = np.zeros(len(columns)) if has_fixed else None
        for k in touched:
            part = parts[k]
            assert part is not None
            own = slice(int(self.start[k]) - span.start, int(self.start[k + 1]) - span.start)
            columns[own] = part.columns
            if fixed is not None and part.fixed is not None:
                fixed[own] = part.fixed
        return CandidateRows(candidate, eta, span, fixed, columns, prior, candidate.about.usual_std)

    def term(self, candidate: Candidate, eta: Eta) -> Term | None:
        """A candidate's rows at η among those of all trials; None where it touches no trial."""
        rows = self.rows_of(candidate, eta)
        return None if rows is None else self.spread(rows)

    def spread(self, rows: CandidateRows) -> Term:
        """Rows of some trials among those of all."""
        columns = np.zeros((len(self.residual), rows.columns.shape[1]))
        columns[rows.span] = rows.columns
        fixed = None
        if rows.fixed is not None:
            fixed = np.zeros(len(self.residual))
            fixed[rows.span] = rows.fixed
        return Term(
            rows.candidate,
            rows.eta,
            fixed,
            columns,
            rows.prior_std,
            rows.tangent_mean,
            rows.usual_std,
            rows.span,
        )

    def see_ahead(self, terms: Sequence[Term], beside: Sequence[Term], near: NoiseScale) -> None:
        """Many terms at once, with their products with others, at a noise scale and where climbs look first.

        Args:
            terms: that will be fitted one by one.
            beside: the same terms, before each of them.
            near: where the climbs begin.
        """
        for noise_scale in self.noise_grid.around(near):
            alike: dict[tuple[int, int], list[Term]] = {}
            for term in terms:
                if not self.basis.kept.has("seen", term.same, noise_scale):
                    alike.setdefault((term.rows.start, term.rows.stop), []).append(term)
            for some in alike.values():
                self._see_together(some, beside, noise_scale)

    def _see_together(self, terms: Sequence[Term], beside: Sequence[Term], noise_scale: NoiseScale) -> None:
        """Terms on the same rows."""
        kept, parts = self.basis.kept, [term.own(self.basis) for term in terms]
        whole = noise_scale.seen(np.concatenate(parts, axis=1), terms[0].rows)
        products = [whole.times(other.seen(noise_scale)) for other in beside]
        ends = np.cumsum([part.shape[1] for part in parts])
        for term, part, end in zip(terms, parts, ends, strict=True):
            own = slice(end - part.shape[1], end)
            seen = Seen(whole.rows, whole.scaled[:, own].copy(), whole.along[:, own].copy())
            kept.put(seen, "seen", term.same, noise_scale)
            for other, product in zip(beside, products, strict=True):
                kept.put(product[own].copy(), "product", term.same, other.same, noise_scale)

    def mass_strain(self, solved: Solved) -> float:
        """How far a hypothesis needs the body's mass from the entered one, in prior standard deviations.

        The posterior mean of a nuisance z ~ N(0, 1) with rows h is hᵀ K⁻¹ (what terms leave).
        """
        return float(solved.noise_scale.whiten(self.basis.transform(self.mass)) @ solved.left)

    def solve_at(self, terms: Sequence[Term], noise_scale: NoiseScale) -> Solved:
        """Terms fitted together at one scale."""
        self.evaluations += len(self.residual)
        std = np.concatenate([t.prior_std for t in terms]) if terms else np.zeros(0)
        M, b, square = normal_equations(terms, noise_scale)
        if not len(std):
            return Solved(
                tuple(terms), noise_scale, noise_scale.constant - 0.5 * square, std, std, np.zeros((0, 0))
            )
        L = self._root(terms, noise_scale, M, std)
        b *= std
        u = cho_solve((L, True), b, check_finite=False)
        log = noise_scale.constant - 0.5 * float(square - b @ u) - float(np.log(np.diag(L)).sum())
        return Solved(tuple(terms), noise_scale, log, u * std, std, L)

    def _root(
        self,
        terms: Sequence[Term],
        noise_scale: NoiseScale,
        M: Float[np.ndarray, "parameters parameters"],
        std: Float[np.ndarray, " parameters"],
    ) -> Float[np.ndarray, "parameters parameters"]:
        """Lower root of I + M at one standard deviation each; that of all terms but the last is kept.

        Many are fitted beside the same others: only what the last adds is factored anew.
        """
        n = len(std) - len(terms[-1].prior_std)

        def of(own: slice, others: slice) -> Float[np.ndarray, "some others"]:
            return np.asarray(M[own, others] * np.outer(std[own], std[others]))

        def factor(own: slice, less: Float[np.ndarray, "own own"] | float = 0.0) -> np.ndarray:
            S = of(own, own) - less
            S[np.arange(len(S)), np.arange(len(S))] += 1.0
            return np.asarray(cholesky(S, lower=True, overwrite_a=True, check_finite=False))

        before, last = slice(0, n), slice(n, None)
        if not n:
            return factor(last)
        first = noise_scale.basis.kept.get(lambda: factor(before), "root", noise_scale, *terms[:-1])
        across = solve_triangular(first, of(last, before).T, lower=True, check_finite=False)
        L = np.zeros((len(std), len(std)))
        L[before, before], L[last, before] = first, across.T
        L[last, last] = factor(last, across.T @ across)
        return L

    def solve(self, terms: Sequence[Term], near: NoiseScale | None = None) -> Solved:
        """Terms fitted together at the scales that suit them best.

        Args:
            terms: any number.
            near: where the climb over the grid of noise scales begins; None: at the usual slack.
        """
        return self.noise_grid.best(lambda noise_scale: self.solve_at(terms, noise_scale), near)


def laboratory_errors(
    trials: Sequence[TrialRows], laboratory: Sequence[Scene] = ()
) -> Float[np.ndarray, "rows columns"]:
    """Of plates tared and placed as well as it is done with care, each column at one standard deviation.

    A newton of shear that stays all through a quiet squat would else be evidence as strong as a fault's. The
    columns are those of the causes themselves, one for each plate, shared by all trials; how far they go
    stands beside the causes (`usual_std`), well below what anybody would act on.

    Args:
        trials: whose rows.
        laboratory: trials whose plates these are; none: the same.
    """
    scenes = laboratory or [t.scene for t in trials]
    rows = sum(len(t.residual) for t in trials)
    found = [np.zeros((rows, 0))]
    for cause in CAUSES:
        std = cause.about.usual_std
        for candidate in cause.candidates(scenes) if std else ():
            if isinstance(candidate, Corrected) or candidate.place_odds:
                continue  # undone already, or rarer than what every laboratory has
            parts = [t.rows_of(candidate, ()) for t in trials]
            width = next((p.columns.shape[1] for p in parts if p is not None), len(candidate.parameters))
            of_trials = [
                np.zeros((len(t.residual), width)) if p is None else p.columns
                for t, p in zip(trials, parts, strict=True)
            ]
            found.append(std * np.concatenate(of_trials))
    return np.concatenate(found, axis=1)
