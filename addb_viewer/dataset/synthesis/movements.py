"""Who is in a synthetic corpus, where they are recorded, and what they do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.simulate.demo_subject import MARKERS, STATIC_MARKERS
from solver.simulate.person import Person, TrueBody, body_of
from solver.simulate.similar import similar_body, similar_trial
from solver.simulate.simulated_trial import Activity, Scenario, SyntheticTrial, simulate_trial
from solver.simulate.walk_and_run import STYLES, GaitStyle
from solver.skeleton.scaling import with_offsets
from solver.skeleton.segment_tables import Sex

ARMS = ("SHO", "UPA", "ELB", "ELM", "FRM", "WRA", "WRB", "FIN")


@dataclass(frozen=True)
class Laboratory:
    """A source of recordings."""

    source: str
    licence: str
    marker_rate: float  # [Hz]
    force_rate: float  # [Hz]
    activities: tuple[str, ...]
    plates: int | None = None  # along the walkway; None: one under every step
    treadmill: bool = False
    arms: bool = True  # whether people wear markers on them
    prefix: str = ""  # of every marker's label

    def markers(self, *, static: bool = False) -> tuple[str, ...]:
        """Which of the body's markers people wear here."""
        names = STATIC_MARKERS if static else MARKERS
        return tuple(name for name in names if self.arms or name[1:] not in ARMS)

    def labels(self, names: Sequence[str]) -> tuple[str, ...]:
        """As the files have them."""
        return tuple(self.prefix + name for name in names)


LABORATORIES = (
    Laboratory("Aare 2019", "CC-BY-4.0", 100.0, 1000.0, ("walk", "squat")),
    Laboratory("Brook 2021", "CC0-1.0", 120.0, 1200.0, ("walk", "run"), treadmill=True, arms=False),
    Laboratory("Cove 2016", "CC-BY-SA-4.0", 60.0, 600.0, ("walk", "stand"), plates=3, prefix="subject:"),
    Laboratory("Dale 2023", "LicenseRef-Dale", 200.0, 2000.0, ("run", "squat", "landing")),
)


YOUNGEST, OLDEST, GROWN = 6.0, 84.0, 18.0  # [years]; the first two are those of the dataset paper
GROWN_SHARE = 0.85
AGES = (6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0)
MEDIAN_M: dict[Sex, tuple[float, ...]] = {
    "female": (1.15, 1.28, 1.38, 1.51, 1.60, 1.62, 1.63),
    "male": (1.15, 1.28, 1.39, 1.49, 1.64, 1.73, 1.76),
}
"""Stature at those ages, to a centimetre or two: CDC growth charts, 2000."""
STATURE_SPREAD = 0.04  # relative standard deviation within sex and age
BMI_AGES = (6.0, 12.0, 18.0, 40.0, 84.0)
MEDIAN_BMI = (15.4, 18.0, 21.5, 25.5, 26.0)  # [kg/m²] at those
BMI_SPREAD = 0.12


@dataclass(frozen=True)
class MadeUpPerson:
    """What is true of somebody."""

    sex: Sex
    age_years: float
    height_m: float
    mass_kg: float


def drawn_person(rng: np.random.Generator) -> MadeUpPerson:
    """Somebody, of any age in the paper's range; most are grown up."""
    sex: Sex = "female" if rng.random() < 0.5 else "male"
    grown = rng.random() < GROWN_SHARE
    age = float(rng.uniform(GROWN, OLDEST) if grown else rng.uniform(YOUNGEST, GROWN))
    height = float(np.interp(age, AGES, MEDIAN_M[sex]) * np.exp(STATURE_SPREAD * rng.standard_normal()))
    bmi = float(np.interp(age, BMI_AGES, MEDIAN_BMI) * np.exp(BMI_SPREAD * rng.standard_normal()))
    return MadeUpPerson(sex, round(age), round(height, 3), round(bmi * height**2, 1))


HEIGHT_M: dict[Sex, float] = {"female": 1.63, "male": 1.76}
DURATION_S = {"static": 0.6, "walk": 2.2, "run": 1.2, "squat": 3.0, "stand": 2.5, "landing": 1.3}
SPEEDS = {"walk": (0.9, 1.6), "run": (2.6, 3.8)}  # [m/s]
USUAL_HEIGHT_M = 1.70  # whose speeds these are, where everybody moves at a speed of their own size
OWN_LENGTHS, OWN_MASSES = 0.035, 0.08  # relative standard deviations of a segment's, everybody for themselves
CADENCE_SPREAD = 0.04  # likewise, of steps a second at a speed
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


@dataclass(frozen=True)
class _Actor:
    """Somebody whose movements are simulated."""

    body: TrueBody
    sex: Sex
    height_m: float
    styles: Mapping[str, GaitStyle]  # of walking and running; none: as most people do
    cadence: float = 1.0


class Actors:
    """The people whose movements are simulated, each when it is first asked for."""

    def __init__(self, count: int | None, seed: int, longest_s: float | None = None) -> None:
        """Draw their bodies.

        Args:
            count: of them, women and men in turn; None: everybody is one.
            seed: of bodies and movements.
            longest_s: that a movement lasts at most, before similarity; None: as long as it takes.
        """
        self._seed, self._longest, self._everybody = seed, longest_s, count is None
        self._actors = [self._usual(k) for k in range(count or 0)]
        self._done: dict[tuple[int, str, int], SyntheticTrial] = {}

    def wearer(self, person: MadeUpPerson, rng: np.random.Generator, before: Wearer | None = None) -> Wearer:
        """Somebody of the proportions of one of them, with markers of their own.

        Args:
            person: whose stature, mass and sex.
            rng: of whose proportions, and of where markers are put.
            before: the same person in an earlier session: markers are put on anew.
        """
        actor = self._of_person(person, rng) if before is None else before.actor
        ratio = person.height_m / self._actors[actor].height_m
        body = similar_body(self._actors[actor].body, ratio, person.mass_kg)
        usual, markers = Person(), body.skeleton.markers
        scatter = np.where([m.fixed for m in markers], usual.bony_scatter_m, usual.cluster_scatter_m)
        offsets = scatter[:, None] * rng.standard_normal((len(markers), 3))
        return Wearer(actor, replace(body, skeleton=with_offsets(body.skeleton, offsets)))

    def can(self, who: Wearer, activity: str) -> bool:
        """Whether somebody does it: what takes long to simulate is done by those like the first alone."""
        return activity not in LONG_TO_SIMULATE or (who.actor == 0 and not self._everybody)

    def movement(self, who: Wearer, activity: str, take: int = 0) -> SyntheticTrial:
        """What somebody does, faster or slower by their size.

        Args:
            who: does it.
            activity: one of `DURATION_S`.
            take: another one has other steps and another speed.
        """
        return similar_trial(self._of(who.actor, activity, take), who.body)

    def _of_person(self, person: MadeUpPerson, rng: np.random.Generator) -> int:
        if not self._everybody:
            alike = [k for k, actor in enumerate(self._actors) if actor.sex == person.sex] or [0]
            return int(rng.choice(alike))
        self._actors.append(self._own(person, len(self._actors)))
        return len(self._actors) - 1

    def _of(self, number: int, activity: str, take: int) -> SyntheticTrial:
        if (number, activity, take) not in self._done:
            what = 1 + list(DURATION_S).index(activity)
            rng = self._rng(number, what, *([take] if take else []))
            actor = self._actors[number]
            lasts = min(DURATION_S[activity], self._longest or np.inf)
            speed = float(rng.uniform(*SPEEDS[activity])) if activity in SPEEDS else None
            if speed and self._everybody:
                speed *= float(np.sqrt(actor.height_m / USUAL_HEIGHT_M))
            scenario = Scenario(
                activity,
                KINDS[activity],
                duration=lasts,
                speed=speed,
                style=actor.styles.get(activity),
                cadence=actor.cadence,
            )
            self._done[number, activity, take] = simulate_trial(scenario, actor.body, rng)
        return self._done[number, activity, take]

    def _usual(self, number: int) -> _Actor:
        sex: Sex = "female" if number % 2 == 0 else "male"
        plain = Person(height_m=HEIGHT_M[sex], sex=sex, bony_scatter_m=0.0, cluster_scatter_m=0.0)
        return _Actor(body_of(plain, self._rng(number, 0)), sex, HEIGHT_M[sex], {})

    def _own(self, person: MadeUpPerson, number: int) -> _Actor:
        rng = self._rng(number, 0)
        told = Person(
            mass_kg=person.mass_kg,
            height_m=person.height_m,
            sex=person.sex,
            length_scatter=OWN_LENGTHS,
            mass_scatter=OWN_MASSES,
            bony_scatter_m=0.0,
            cluster_scatter_m=0.0,
        )
        body = body_of(told, rng)
        styles = {name: drawn_style(STYLES[name], rng) for name in SPEEDS}
        cadence = float(np.exp(CADENCE_SPREAD * rng.standard_normal()))
        return _Actor(body, person.sex, person.height_m, styles, cadence)

    def _rng(self, actor: int, *what: int) -> np.random.Generator:
        return np.random.default_rng((self._seed, actor, *what))


def drawn_style(style: GaitStyle, rng: np.random.Generator) -> GaitStyle:
    """Somebody's own way to walk or run.

    Args:
        style: of most people.
        rng: of the differences: as a relative, or an absolute standard deviation each.
    """
    width, swing, bounce, braking = np.exp((0.25, 0.25, 0.15, 0.10) * rng.standard_normal(4))
    toe_out, lean, tilt, elbow = (4.0, 3.0, 4.0, 10.0) * rng.standard_normal(4)
    first, *others = style.harmonics
    return replace(
        style,
        step_width=style.step_width * width,
        arm_swing_deg=style.arm_swing_deg * swing,
        bounce=style.bounce * bounce,
        braking=style.braking * braking,
        toe_out_deg=style.toe_out_deg + toe_out,
        trunk_lean_deg=style.trunk_lean_deg + lean,
        pelvis_tilt_deg=style.pelvis_tilt_deg + tilt,
        elbow_deg=max(style.elbow_deg + elbow, 5.0),
        harmonics=(first, *(one * float(np.exp(0.2 * rng.standard_normal())) for one in others)),
    )
