"""What kinematic gaits do without a recording of it: stairs, ramps, lunges, jumps, one foot, starts and ends.

Sizes are drawn from the ranges beside them; where a range is from a code or a paper, that is named.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from benchmarks.activities.examples import SIMULATED, Example
from benchmarks.activities.kinematic_gaits import (
    LONG_S,
    RATE,
    Hips,
    Plant,
    Puppet,
    earlier,
    kinematic_gait,
    steps,
)
from benchmarks.activities.simulated import FEET, load_of
from solver.common.gravity import GRAVITY
from solver.gait.activity import Activity, Kind
from solver.kinematics.motion import Motion
from solver.skeleton.pinocchio_model import RigidBodyModel

PERSONS = range(200, 210)  # seeds
RISER_M = (0.10, 0.22)  # International Building Code 1011.5.2: from 0.102; Approved Document K: to 0.22
BLONDEL_M = 0.63  # two risers and a tread: a step of a stair
RAMP = (0.05, 0.125)  # ADA Standards 403.3, 405.2: from 1:20; to 1:12, in old buildings up to 1:8
FLOOR = (0.0, 0.0208)  # ADA Standards 305.2, 403.3: up to 1:48 where ground is to be level
LUNGE_LEGS = (0.6, 1.0)  # of a leg's length
STAGGER_LEGS = (0.0, 0.25)  # of a squat, in which one foot may be somewhat ahead
BOX_M = (0.2, 0.6)  # of drop and box jumps
JUMP_M = (0.08, 0.45)  # that hips rise in flight
HELD_S = (0.5, 3.0)  # of a squat jump: most protocols say 2 to 3 s, people do less
ONE_FOOT_S = (1.5, 8.0)  # who holds less than 5 s is at risk (Vellas 1997)
SET_ANEW_S = (0.3, 0.8)  # that a foot is off the ground when somebody who stands sets it otherwise
STEP_S, STEP_LEGS = (0.48, 0.62), (0.62, 0.82)  # of comfortable walks
SWAY_M = (0.003, 0.02)  # RMS, quiet to restless
LOOKS_AHEAD_S = 1.0  # that a window sees: a squat that is held longer is not yet called a jump
TOEOFF = -0.6  # [rad]
Drawn = Callable[[tuple[float, float]], float]
Scene = tuple[str, Activity, Kind | None, Sequence[Plant], float, Hips | None, tuple[float, float] | None]
"""Name, activity, sub-label, feet, duration [s], hips, and from when until when it is that [s]."""


def performed() -> Iterator[Example]:
    """All of all persons."""
    for seed in PERSONS:
        somebody = kinematic_gait(seed)
        rng = np.random.default_rng([seed, 1])
        model = RigidBodyModel(somebody.skeleton)
        before: tuple[Sequence[Plant], Motion] | None = None
        for name, activity, kind, plants, duration, hips, during in _scenes(somebody, rng):
            if before and before[0] is plants:
                motion = before[1]
            else:
                motion = somebody.moved(plants, duration, rng, hips, rng.uniform(*SWAY_M))
            before = plants, motion
            yield Example(
                SIMULATED, f"person {seed}, {name}", activity, kind, somebody.skeleton, FEET, motion,
                load_BW=load_of(model, motion),
                during=None if during is None else (round(during[0] * RATE), round(during[1] * RATE)),
            )  # fmt: skip


def _scenes(who: Puppet, rng: np.random.Generator) -> Iterator[Scene]:
    def drawn(between: tuple[float, float]) -> float:
        return float(rng.uniform(*between))

    yield from _ways(who, drawn)
    yield from _starts(who, drawn)
    for name, hold in (("quick lunge", (0.0, 0.3)), ("held lunge", (0.3, 2.0))):
        yield _lunge(name, who, drawn, drawn(hold))
    yield _squat(who, drawn)
    yield from _jumps(who, drawn)
    yield from _standing(drawn)


def _ways(who: Puppet, drawn: Drawn) -> Iterator[Scene]:
    for up, kind in ((1, Kind.UP), (-1, Kind.DOWN)):
        riser, step_s = drawn(RISER_M), drawn((0.5, 0.8))
        plants = steps([(BLONDEL_M - 2 * riser, up * riser)] * 11, step_s, lands=0.0 if up > 0 else -0.35)
        yield f"stairs {kind}", Activity.STAIRS, kind, earlier(plants, 1.5 * step_s), 9 * step_s, None, None
    for name, slope, kind in (
        ("ramp up", drawn(RAMP), Kind.INCLINE),
        ("ramp down", -drawn(RAMP), Kind.INCLINE),
        ("floor up", drawn(FLOOR), Kind.OVERGROUND),
        ("floor down", -drawn(FLOOR), Kind.OVERGROUND),
    ):
        step_s, step_m = drawn(STEP_S), drawn(STEP_LEGS) * who.leg
        plants = steps([(step_m, slope * step_m)] * 13, step_s, slope=float(np.arctan(slope)))
        yield name, Activity.WALKING, kind, earlier(plants, 2.5 * step_s), 10 * step_s, None, None


def _starts(who: Puppet, drawn: Drawn) -> Iterator[Scene]:
    """Judged are half seconds from first foot-off to second contact, and those that see nothing of it."""
    step_s, step_m = drawn(STEP_S), drawn(STEP_LEGS) * who.leg
    begin = drawn((3.0, 4.0))
    under_way, duration = begin + 2 * step_s, begin + 10.5 * step_s
    start = steps([(step_m / 2, 0.0), *[(step_m, 0.0)] * 12], step_s, begin)
    yield "start", Activity.TRANSITION, Kind.START, start, duration, None, (begin, under_way)
    yield "start, before", Activity.STANDING, None, start, duration, None, (0.0, begin - 1.0)
    yield "start, after", Activity.WALKING, None, start, duration, None, (under_way + 1.0, duration)
    end = earlier(steps([(step_m, 0.0)] * 11, step_s), 2.5 * step_s)
    slows, stands = end[-3].start, end[-1].start
    yield "end", Activity.TRANSITION, Kind.END, end, stands + 3.5, None, (slows, stands)
    yield "end, before", Activity.WALKING, None, end, stands + 3.5, None, (0.0, slows - 1.0)
    yield "end, after", Activity.STANDING, None, end, stands + 3.5, None, (stands + 1.0, stands + 3.5)


def _lunge(name: str, who: Puppet, drawn: Drawn, hold: float) -> Scene:
    far, low = drawn(LUNGE_LEGS) * who.leg, drawn((0.5, 0.65))
    lands = 1.5 + drawn((0.4, 0.6))
    down = lands + drawn((0.4, 0.9))
    up = down + hold
    leaves = up + drawn((0.4, 0.8))
    back = leaves + drawn((0.4, 0.6))
    plants = [
        Plant(0, -LONG_S, 1.5, 0.0),
        Plant(0, lands, leaves, far),
        Plant(0, back, LONG_S, 0.0, lands=0.0),
        Plant(1, -LONG_S, LONG_S, 0.0, tiptoe=(lands, up)),
    ]
    hips = Hips((0.0, 1.4, lands, down, up + 1e-3, leaves, back + 0.2),
                (1.0, 1.0, 0.9, low, low, 0.9, 1.0), (0.0, 0.0, -0.2, 0.0, 0.0, 0.2, 0.0))  # fmt: skip
    return name, Activity.LUNGE, None, plants, back + 2.0, hips, (1.5, back)


def _squat(who: Puppet, drawn: Drawn) -> Scene:
    ahead, low, half = drawn(STAGGER_LEGS) * who.leg, drawn((0.45, 0.68)), drawn((0.7, 1.3))
    plants = [Plant(0, -LONG_S, LONG_S, ahead), Plant(1, -LONG_S, LONG_S, 0.0)]
    times = [0.0, *(1.0 + half * k for k in range(7))]
    hips = Hips(times, [1.0, 1.0, low, 1.0, low, 1.0, low, 1.0], [0.0] * 8)
    return "squats", Activity.SQUAT, None, plants, times[-1] + 1.0, hips, (1.0, times[-1])


def _jumps(who: Puppet, drawn: Drawn) -> Iterator[Scene]:
    for name, kind, box, held in (
        ("jump", Kind.PLAIN_JUMP, 0.0, 0.0),
        ("squat jump", Kind.SQUAT_JUMP, 0.0, drawn(HELD_S)),
        ("box jump", Kind.BOX_JUMP, drawn(BOX_M), 0.0),
    ):
        speed = np.sqrt(2 * GRAVITY * (box + drawn(JUMP_M)))
        jumps = _Jumps(who, drawn)
        jumps.crouch(drawn((0.4, 0.7)), held)
        jumps.fly(float(speed), box, drawn((0.0, 0.3)) + (0.4 if box else 0.0))
        yield name, Activity.JUMP, kind, *jumps.ended()
    jumps = _Jumps(who, drawn, drawn(BOX_M))
    jumps.crouch(0.3, 0.0, 0.93)
    jumps.fly(float(np.sqrt(2 * GRAVITY * 0.03)), 0.0, drawn((0.3, 0.5)))
    jumps.fly(float(np.sqrt(2 * GRAVITY * drawn(JUMP_M))), 0.0, drawn((0.0, 0.2)))
    yield "drop jump", Activity.JUMP, Kind.DROP_JUMP, *jumps.ended()


class _Jumps:
    """Hips and feet of somebody who stands, crouches, and is in the air now and then."""

    def __init__(self, who: Puppet, drawn: Drawn, height: float = 0.0) -> None:
        self.who, self.drawn = who, drawn
        self.x, self.height = 0.0, height
        self.time = self.begin = drawn((0.8, 1.5))
        self.landed, self.lands = -LONG_S, 0.0
        self.feet: list[Plant] = []
        self.knots: list[tuple[float, float, float]] = [(0.0, 1.0, 0.0), (self.time, 1.0, 0.0)]
        self.knots = [(t, share + height / who.stretched, v) for t, share, v in self.knots]

    def _knot(self, seconds: float, share: float, speed: float = 0.0) -> None:
        self.time += seconds
        self.knots.append((self.time, share + self.height / self.who.stretched, speed))

    def crouch(self, seconds: float, held: float, low: float | None = None) -> None:
        """Down, and wait."""
        self.low = low or self.drawn((0.62, 0.75))
        self._knot(seconds, self.low)
        if held:
            self._knot(held, self.low)

    def fly(self, speed: float, height: float, far: float) -> None:
        """Push off with a speed, land at a height and so far ahead, and sink into the knees."""
        tall = (self.who.ball[0] * np.sin(-TOEOFF) + 0.97 * self.who.stretched) / self.who.stretched
        self._knot(2 * (tall - self.low) * self.who.stretched / speed, tall, speed)
        if self.landed < 0:
            self.begin = max(self.begin, self.time - LOOKS_AHEAD_S)
        self._plant(self.time)
        falls = float(np.sqrt(speed**2 - 2 * GRAVITY * (height - self.height)))
        self.x, self.height = self.x + far, height
        self._knot((speed + falls) / GRAVITY, tall, -falls)
        self.landed, self.lands = self.time, TOEOFF
        self.low = self.drawn((0.65, 0.8))
        self._knot(2 * (tall - self.low) * self.who.stretched / falls, self.low)

    def _plant(self, until: float) -> None:
        self.feet += [
            Plant(foot, self.landed, until, self.x, self.height, self.lands, TOEOFF, flies=True)
            for foot in range(2)
        ]

    def ended(self) -> tuple[list[Plant], float, Hips, tuple[float, float]]:
        """Feet, duration, hips, and from when until when somebody jumps."""
        self._knot(self.drawn((0.5, 0.8)), 1.0)
        self._plant(LONG_S)
        times, heights, speeds = zip(*self.knots, strict=True)
        speeds = tuple(speed / self.who.stretched for speed in speeds)
        return self.feet, self.time + 1.0, Hips(times, heights, speeds), (self.begin, self.landed + 0.3)


def _standing(drawn: Drawn) -> Iterator[Scene]:
    for name, kind, off, high, far in (
        ("one foot", Kind.ONE_FOOT, drawn(ONE_FOOT_S), drawn((0.1, 0.3)), 0.0),
        ("both feet", Kind.BOTH_FEET, drawn(SET_ANEW_S), drawn((0.03, 0.1)), drawn((0.03, 0.15))),
    ):
        plants = [
            Plant(0, -LONG_S, 1.5, 0.0, leaves=-0.2, clearance=high),
            Plant(0, 1.5 + off, LONG_S, far, lands=0.0),
            Plant(1, -LONG_S, LONG_S, 0.0),
        ]
        during = (1.5, 1.5 + off) if kind is Kind.ONE_FOOT else None
        yield name, Activity.STANDING, kind, plants, off + 3.0, None, during
