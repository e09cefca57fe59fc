"""The likeliest unknown forces beside accepted causes: anywhere near a body, at points, along axes."""

from collections.abc import Sequence
from dataclasses import dataclass

from solver.diagnosis.noise.noise_grid import MODEL_SCALES
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.screening import beside
from solver.diagnosis.search.terms import Solved, Term
from solver.diagnosis.unmodelled.remainder import Unknown, UnknownForce
from solver.diagnosis.unmodelled.unknown_screen import Tried, UnknownScreen
from solver.diagnosis.unmodelled.unknown_time_history import mostly_swings

PLACED = 34  # bodies, and time histories of each, at which the point of an unknown force is sought


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
