"""What people of a made-up corpus do: simulated for a few of them, done in similarity by the others."""

from dataclasses import dataclass, replace

import numpy as np

from addb_viewer.dataset.synthesis.people import MadeUpPerson
from solver.simulate.person import Person, TrueBody, body_of
from solver.simulate.similar import similar_body, similar_trial
from solver.simulate.trial import Activity, Scenario, SyntheticTrial, simulate_trial
from solver.skeleton.scaling import with_offsets
from solver.skeleton.segment_tables import Sex

HEIGHT_M: dict[Sex, float] = {"female": 1.63, "male": 1.76}
DURATION_S = {"static": 0.6, "walk": 2.2, "run": 1.2, "squat": 3.0, "stand": 2.5, "landing": 1.3}
SPEEDS = {"walk": (0.9, 1.6), "run": (2.6, 3.8)}  # [m/s]
LONG_TO_SIMULATE = ("landing",)  # a minute
KINDS: dict[str, Activity] = {
    "static": "stand",
    "walk": "walk",
    "run": "run",
    "squat": "squat",
    "stand": "stand",
    "landing": "landing",
}


@dataclass(frozen=True)
class Wearer:
    """Somebody with markers on: a body, and whose movements it does in similarity."""

    actor: int
    body: TrueBody


class Actors:
    """The few people whose movements are simulated, each when it is first asked for."""

    def __init__(self, count: int, seed: int, longest_s: float | None = None) -> None:
        """Draw their bodies.

        Args:
            count: of them; women and men in turn.
            seed: of bodies and movements.
            longest_s: that a movement lasts at most, before similarity; None: as long as it takes.
        """
        self._seed, self._longest = seed, longest_s
        self._bodies = [self._body(k) for k in range(count)]
        self._done: dict[tuple[int, str], SyntheticTrial] = {}

    def wearer(self, person: MadeUpPerson, rng: np.random.Generator, before: Wearer | None = None) -> Wearer:
        """Somebody of the proportions of one of them, with markers of their own.

        Args:
            person: whose stature, mass and sex.
            rng: of whose proportions, and of where markers are put.
            before: the same person in an earlier session: markers are put on anew.
        """
        alike = [k for k in range(len(self._bodies)) if _sex(k) == person.sex] or [0]
        actor = int(rng.choice(alike)) if before is None else before.actor
        ratio = person.height_m / HEIGHT_M[_sex(actor)]
        body = similar_body(self._bodies[actor], ratio, person.mass_kg)
        usual, markers = Person(), body.skeleton.markers
        scatter = np.where([m.fixed for m in markers], usual.bony_scatter_m, usual.cluster_scatter_m)
        offsets = scatter[:, None] * rng.standard_normal((len(markers), 3))
        return Wearer(actor, replace(body, skeleton=with_offsets(body.skeleton, offsets)))

    def can(self, who: Wearer, activity: str) -> bool:
        """Whether somebody does it: what takes long to simulate is done by those like the first alone."""
        return activity not in LONG_TO_SIMULATE or who.actor == 0

    def movement(self, who: Wearer, activity: str) -> SyntheticTrial:
        """What somebody does, faster or slower by their size."""
        return similar_trial(self._of(who.actor, activity), who.body)

    def _of(self, actor: int, activity: str) -> SyntheticTrial:
        if (actor, activity) not in self._done:
            rng = self._rng(actor, 1 + list(DURATION_S).index(activity))
            lasts = min(DURATION_S[activity], self._longest or np.inf)
            speed = float(rng.uniform(*SPEEDS[activity])) if activity in SPEEDS else None
            scenario = Scenario(activity, KINDS[activity], duration=lasts, speed=speed)
            self._done[actor, activity] = simulate_trial(scenario, self._bodies[actor], rng)
        return self._done[actor, activity]

    def _body(self, actor: int) -> TrueBody:
        sex = _sex(actor)
        plain = Person(height_m=HEIGHT_M[sex], sex=sex, bony_scatter_m=0.0, cluster_scatter_m=0.0)
        return body_of(plain, self._rng(actor, 0))

    def _rng(self, actor: int, what: int) -> np.random.Generator:
        return np.random.default_rng((self._seed, actor, what))


def _sex(actor: int) -> Sex:
    return "female" if actor % 2 == 0 else "male"
