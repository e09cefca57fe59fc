"""Every force of unknown time history against the balance, beside any accepted causes; the likeliest of them.

Rows are splines times levers, each for a few windows: only these are kept, and all points of a trial share
them. Their product with a noise scale's precision serves every direction, every size, and whatever is
accepted, which only takes a matrix of low rank off it (see `screening`). All places of one trial are asked
together. Each force is tried anywhere near a body, at the point that it speaks for, and along single axes.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg.lapack import dpotrf, dtrtrs

from solver.diagnosis.causes.effect import Eta
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.noise.balance_rows import TrialRows
from solver.diagnosis.noise.noise_grid import MODEL_SCALES
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.screening import Beside, beside
from solver.diagnosis.search.terms import Solved, Term
from solver.diagnosis.unmodelled.remainder import (
    Unknown,
    UnknownForce,
    UnknownMoment,
    mostly_swings,
    unknown_forces,
)

Place = tuple[str, bytes]  # body, point on it
MOMENT: Place = ("", b"")
TimeHistoryKey = tuple[str, float, float | None]  # trial, knots, frequency
Products = tuple[tuple[np.ndarray, np.ndarray | None], ...]  # of each place, its own and with moments
PLACED = 34  # bodies, and time histories of each, at which the point of an unknown force is sought


@dataclass(frozen=True, eq=False)
class TimeHistories:
    """Splines of one trial and the windows for which each lasts; a constant is their sum."""

    trial: TrialRows
    span: slice  # rows of the trial
    splines: Float[np.ndarray, "frames splines"]

    @property
    def count(self) -> int:
        """How many."""
        return self.splines.shape[1]

    @cached_property
    def windows(self) -> Int[np.ndarray, "splines some"]:
        """Those of each, all equally many."""
        there = self.trial.windows.means(self.splines) > 0
        every = len(there)
        first = np.where(there.any(axis=0), there.argmax(axis=0), 0)
        last = np.where(there.any(axis=0), every - there[::-1].argmax(axis=0), 1)
        length = int((last - first).max())
        return np.asarray(np.minimum(first, every - length)[:, None] + np.arange(length))

    def means(self, lever: Float[np.ndarray, " frames"] | float = 1.0) -> Float[np.ndarray, "splines some"]:
        """Of each spline times a lever, over its windows."""
        whole = self.trial.windows.means(np.multiply(lever, self.splines.T).T)
        return np.asarray(whole[self.windows, np.arange(self.count)[:, None]])

    def moments(self) -> Float[np.ndarray, "splines 3 rows"]:
        """Moments about the ground's axes."""
        means = self.means()
        rows = np.zeros((*means.shape, 3, 6))
        for axis in range(3):
            rows[:, :, axis, 3 + axis] = means
        return _by_rows(rows)

    def forces(self, arm_ground: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "splines 3 rows"]:
        """Forces along them, this far from the centre of mass [m], and their moments about it."""
        force = self.means()
        x, y, z = (self.means(arm_ground[:, i]) for i in range(3))
        rows = np.zeros((*force.shape, 3, 6))
        for axis in range(3):
            rows[:, :, axis, axis] = force
        rows[:, :, 0, 4], rows[:, :, 0, 5] = z, -y
        rows[:, :, 1, 3], rows[:, :, 1, 5] = -z, x
        rows[:, :, 2, 3], rows[:, :, 2, 4] = y, -x
        return _by_rows(rows)


@dataclass(frozen=True, eq=False)
class Located:
    """Splines along the ground's axes at some places of one trial, on the rows of their windows alone."""

    time_histories: TimeHistories
    places: tuple[Place, ...]
    columns: Float[np.ndarray, "splines axes rows"]  # three axes of each place, one place after the other

    def axes(self, place: Place) -> slice:
        """Of one place."""
        k = 3 * self.places.index(place)
        return slice(k, k + 3)

    def times(
        self, rows: Float[np.ndarray, "own some"], axes: slice = slice(None)
    ) -> Float[np.ndarray, "axes splines some"]:
        """Columnsᵀ rows."""
        columns = self.columns[:, axes]
        found = np.empty((columns.shape[1], len(columns), rows.shape[1]))
        for k, first in enumerate(6 * self.time_histories.windows[:, 0]):
            found[:, k] = columns[k] @ rows[first : first + columns.shape[2]]
        return found

    def sum(self, sizes: Float[np.ndarray, "axes splines"], axes: slice) -> Float[np.ndarray, " own"]:
        """All columns of some axes together, each of some size."""
        span = self.time_histories.span
        rows = np.zeros(span.stop - span.start)
        for k, first in enumerate(6 * self.time_histories.windows[:, 0]):
            part = self.columns[k, axes]
            rows[first : first + part.shape[1]] += sizes[:, k] @ part
        return rows


def with_constants(values: Float[np.ndarray, "axes splines *rest"]) -> Float[np.ndarray, "columns *rest"]:
    """Something linear in columns, before each axis' splines that of their sum."""
    whole = np.concatenate([values.sum(axis=1, keepdims=True), values], axis=1)
    return whole.reshape(whole.shape[0] * whole.shape[1], *values.shape[2:])


def _by_rows(columns: Float[np.ndarray, "splines some 3 6"]) -> Float[np.ndarray, "splines 3 rows"]:
    """Six rows a window."""
    splines, some = columns.shape[:2]
    return np.ascontiguousarray(columns.transpose(0, 2, 1, 3)).reshape(splines, 3, 6 * some)


@dataclass(frozen=True, eq=False)
class Tried:
    """An unknown force or moment at its best size."""

    candidate: Unknown
    eta: Eta
    gain: float  # log evidence beyond the accepted causes, at the same noise scale
    x: Float[np.ndarray, " parameters"]


class UnknownScreen:
    """Unknown forces of all trials, each against the balance."""

    def __init__(self, balance: Balance) -> None:
        self._balance = balance
        self.free = unknown_forces(balance.scenes)  # at no point in particular yet
        self._trials = {t.scene.name: k for k, t in enumerate(balance.trials)}
        self._time_histories: dict[TimeHistoryKey, TimeHistories] = {}
        self._centres: dict[TimeHistoryKey, Located] = {}

    def at(self, candidates: Sequence[Unknown], beside: Beside) -> list[Tried]:
        """Each candidate at its best size, greatest gain first.

        Args:
            candidates: of any trials.
            beside: accepted causes at one scale of the model error.
        """
        together = defaultdict(list)
        for candidate in dict.fromkeys(candidates):
            together[_time_history_key(candidate)].append(candidate)
        tried = {t.candidate: t for own in together.values() for t in self._of_one_time_history(own, beside)}
        return sorted((tried[c] for c in candidates), key=lambda t: -t.gain)

    def time_history_ground(self, one: Tried) -> Float[np.ndarray, "frames 3"]:
        """The force [N] or the moment [N·m] over the trial."""
        return self._time_histories_of(one.candidate).splines @ self._coefficients(one)[0].T

    def explained(self, one: Tried) -> Float[np.ndarray, " rows"]:
        """What it takes off the residual, in all trials' rows."""
        centres, place = self._centres_of(one.candidate), self._place(one.candidate)
        located = centres if place in centres.places else self._locate([one.candidate])
        first, moments = self._coefficients(one)
        rows = np.zeros(int(self._balance.start[-1]))
        rows[located.time_histories.span] = located.sum(first, located.axes(place))
        if moments is not None:
            rows[located.time_histories.span] += centres.sum(moments, centres.axes(MOMENT))
        return rows

    def _coefficients(
        self, one: Tried
    ) -> tuple[Float[np.ndarray, "3 splines"], Float[np.ndarray, "3 splines"] | None]:
        """Of the splines along the axes of the force or pure moment, then of what moment a force brings."""
        by_axis = one.x.reshape(-1, 1 + self._time_histories_of(one.candidate).count)
        whole = by_axis[:, :1] + by_axis[:, 1:]
        axes, _ = _axes(one.candidate)
        first = np.zeros((3, whole.shape[1]))
        first[axes] = whole[: len(axes)]
        if not _is_free(one.candidate):
            return first, None
        return first, self._reach_m(one.candidate) * whole[3:]

    def _of_one_time_history(self, candidates: Sequence[Unknown], beside: Beside) -> list[Tried]:
        """Candidates of one trial that share their splines."""
        centres = self._centres_of(candidates[0])
        here = [c for c in candidates if self._place(c) in centres.places]
        elsewhere = [c for c in candidates if self._place(c) not in centres.places]
        tried = self._try_all(centres, here, beside) if here else []
        if elsewhere:
            tried += self._try_all(self._locate(elsewhere), elsewhere, beside)
        return tried

    def _try_all(self, located: Located, candidates: Sequence[Unknown], beside: Beside) -> list[Tried]:
        """Those at some places."""
        noise_scale = beside.noise_scale
        if located in self._centres.values():
            products = noise_scale.basis.kept.get(
                lambda: self._products(located, noise_scale), "products", located, noise_scale
            )
        else:  # hardly ever asked for again
            products = self._products(located, noise_scale)
        span = located.time_histories.span
        seen = located.times(np.column_stack([beside.by_rows(span), beside.left_by_rows[span]]))
        return [self._at_its_size(located, c, products, seen) for c in candidates]

    def _at_its_size(
        self,
        located: Located,
        candidate: Unknown,
        products: Products,
        seen: Float[np.ndarray, "axes splines accepted+1"],
    ) -> Tried:
        """One of them: its columns of a unit size, their information, and what they see of what is left."""
        place, each = self._place(candidate), 1 + located.time_histories.count
        axes, sizes = _axes(candidate)
        own = (axes[:, None] * each + np.arange(each)).ravel()
        whole, across = products[located.places.index(place)]
        information = whole[np.ix_(own, own)]
        of_left = with_constants(seen[located.axes(place)])[own]
        unit = scale = np.repeat(sizes, each) * self._scene(candidate).weight_N
        if _is_free(candidate):
            assert across is not None
            of_moments, _ = products[located.places.index(MOMENT)]
            information = np.block([[information, across], [across.T, of_moments]])
            of_left = np.concatenate([of_left, with_constants(seen[located.axes(MOMENT)])])
            unit, scale = np.tile(unit, 2), np.concatenate([scale, self._reach_m(candidate) * scale])
        of_left *= scale[:, None]
        W, b = of_left[:, :-1], of_left[:, -1]
        information *= scale[:, None]
        information *= scale
        information -= W @ W.T
        eta, gain, u = _best_size(information, b, candidate.starts(self._balance.scenes))
        return Tried(candidate, eta, gain, eta[0] * unit * u)

    def _products(self, located: Located, noise_scale: NoiseScale) -> Products:
        """Columnsᵀ P columns of each place, nothing accepted, and with those of moments; constants first."""
        weighted = located.times(noise_scale.precision_at(located.time_histories.span))
        found = []
        for place in located.places:
            axes = located.axes(place)
            by_rows = with_constants(weighted[axes]).T
            own = with_constants(located.times(by_rows, axes))
            across = None
            if MOMENT in located.places and place != MOMENT:
                across = with_constants(located.times(by_rows, located.axes(MOMENT))).T
            found.append((own, across))
        return tuple(found)

    def _scene(self, candidate: Unknown) -> Scene:
        return self._balance.trials[self._trials[candidate.trial]].scene

    def _reach_m(self, candidate: Unknown) -> float:
        assert isinstance(candidate, UnknownForce)
        return candidate.reach_m(self._scene(candidate))

    def _time_histories_of(self, candidate: Unknown) -> TimeHistories:
        """Its time histories but for the constant."""
        key = _time_history_key(candidate)
        if key not in self._time_histories:
            k = self._trials[candidate.trial]
            trial, start = self._balance.trials[k], self._balance.start
            splines = candidate.time_histories(trial.scene)[:, 1:]
            self._time_histories[key] = TimeHistories(trial, slice(int(start[k]), int(start[k + 1])), splines)
        return self._time_histories[key]

    def _centres_of(self, candidate: Unknown) -> Located:
        """The centres of mass of all bodies of its trial, and moments, along its time histories."""
        key = _time_history_key(candidate)
        if key not in self._centres:
            trial, knot_s, frequency_Hz = key
            bodies = dict.fromkeys(
                c.target for c in self.free if isinstance(c, UnknownForce) and c.trial == trial
            )
            free = [UnknownForce(name, trial, knot_s, frequency_Hz=frequency_Hz) for name in bodies]
            self._centres[key] = self._locate(
                [*free, UnknownMoment("", trial, knot_s, frequency_Hz=frequency_Hz)]
            )
        return self._centres[key]

    def _locate(self, candidates: Sequence[Unknown]) -> Located:
        """Columns at all places of candidates that share their splines."""
        time_histories = self._time_histories_of(candidates[0])
        scene = time_histories.trial.scene
        columns = {}
        for one in candidates:
            if (place := self._place(one)) in columns:
                continue
            if isinstance(one, UnknownForce):
                columns[place] = time_histories.forces(one.place_ground(scene) - scene.com_ground)
            else:
                columns[place] = time_histories.moments()
        return Located(time_histories, tuple(columns), np.concatenate(list(columns.values()), axis=1))

    def _place(self, candidate: Unknown) -> Place:
        if not isinstance(candidate, UnknownForce):
            return MOMENT
        skeleton, point = self._scene(candidate).skeleton, candidate.point_body
        centre = skeleton.bodies[skeleton.body_index(candidate.target)].com_body
        return candidate.target, np.asarray(centre if point is None else point, dtype=float).tobytes()


def _best_size(
    information: Float[np.ndarray, "own own"], b: Float[np.ndarray, " own"], sizes: Sequence[Eta]
) -> tuple[Eta, float, Float[np.ndarray, " own"]]:
    """The best of ascending sizes, sought from the middle one both ways as long as the next is better.

    Returns:
        The size, the log evidence that it adds, and the coefficients over the size.
    """

    def at(k: int) -> tuple[float, np.ndarray, np.ndarray]:
        (size,) = sizes[k]
        S = size**2 * information
        S[np.arange(len(S)), np.arange(len(S))] += 1.0
        L, _ = dpotrf(S.T, lower=1, clean=0, overwrite_a=1)
        u, _ = dtrtrs(L, size * b, lower=1)
        return 0.5 * float(u @ u) - float(np.log(np.diag(L)).sum()), L, u

    middle = len(sizes) // 2
    k, best = middle, (begun := at(middle))
    for way in (-1, 1):
        at_way, here = middle, begun
        while 0 <= at_way + way < len(sizes) and (further := at(at_way + way))[0] > here[0]:
            at_way, here = at_way + way, further
        if here[0] > best[0]:
            k, best = at_way, here
    gain, L, u = best
    x, _ = dtrtrs(L, u, lower=1, trans=1)
    return sizes[k], gain, x


def _axes(candidate: Unknown) -> tuple[Int[np.ndarray, " axes"], Float[np.ndarray, " axes"]]:
    """Which axes a force has at its place, or a moment, and their relative sizes."""
    if not isinstance(candidate, UnknownForce):
        return np.arange(3), np.ones(3)
    sizes = np.array(candidate.directions)
    return np.flatnonzero(sizes), sizes[sizes != 0]


def _is_free(candidate: Unknown) -> bool:
    """Whether it acts anywhere near a body's centre of mass, and so brings a moment."""
    return isinstance(candidate, UnknownForce) and candidate.point_body is None


def _time_history_key(candidate: Unknown) -> TimeHistoryKey:
    return candidate.trial, candidate.knot_s, candidate.frequency_Hz


@dataclass(frozen=True, eq=False)
class Sought:
    """An unknown force or moment beside accepted causes, at one noise scale."""

    log_evidence: float  # with it
    tried: Tried
    noise_scale: NoiseScale


class UnknownSearch:
    """Keeps what was found beside each set of causes: the same sets are asked for again and again."""

    def __init__(self, balance: Balance) -> None:
        self.balance = balance
        self.screen = UnknownScreen(balance)
        self._kept: dict[tuple[int, ...], tuple[tuple[Term, ...], list[Sought]]] = {}  # ids stay theirs

    def likeliest(self, solved: Solved) -> list[Sought]:
        """Unknown forces and moments beside accepted causes, also the least free of each, likeliest first."""
        key = (id(solved.noise_scale), *map(id, solved.terms))
        if key not in self._kept:
            self._kept[key] = solved.terms, self._with_places(solved.terms, self._anywhere(solved))
        return self._kept[key][1]

    def _anywhere(self, solved: Solved) -> list[Sought]:
        """The best time history of each body and trial: where causes fit best, where errors are smallest."""
        sharpest = self.balance.noise_grid.nearest(min(MODEL_SCALES), solved.noise_scale.slack)
        found: list[Sought] = []
        for noise_scale in {id(r): r for r in (solved.noise_scale, sharpest)}.values():
            base = self.balance.solve_at(solved.terms, noise_scale).log_evidence
            nearly: dict[tuple[str, str, bool], Tried] = {}
            for one in self.screen.at(self.screen.free, beside(solved.terms, noise_scale)):
                swings = one.candidate.frequency_Hz is not None
                nearly.setdefault((one.candidate.target, one.candidate.trial, swings), one)
            found += [Sought(base + one.gain, one, noise_scale) for one in list(nearly.values())[:PLACED]]
        return found

    def _with_places(self, terms: Sequence[Term], anywhere: Sequence[Sought]) -> list[Sought]:
        """Each also at the point that it speaks for and along single axes, from wherever it was found."""
        scenes = self.balance.scenes
        placed: list[Unknown] = []
        for sought in anywhere:
            if isinstance(candidate := sought.tried.candidate, UnknownForce):
                scene = candidate.scene(scenes)
                at = candidate.at_its_point(scene, sought.tried.x)
                placed += [at, *at.along_an_axis(scene), *candidate.along_an_axis(scene)]
        found = list(anywhere)
        for noise_scale in {id(s.noise_scale): s.noise_scale for s in anywhere}.values():
            base = self.balance.solve_at(terms, noise_scale).log_evidence
            found += [
                Sought(base + one.gain - one.candidate.reach_cost(scenes), one, noise_scale)
                for one in self.screen.at(placed, beside(terms, noise_scale))
            ]
        time_history = self.screen.time_history_ground
        found = [
            s for s in found if s.tried.candidate.frequency_Hz is None or mostly_swings(time_history(s.tried))
        ]
        return sorted(found, key=lambda s: -s.log_evidence)
