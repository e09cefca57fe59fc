"""Walking and running on level ground: footprints, timing, and what the body should look like.

Angle patterns over one gait cycle are our own sketches of what textbooks draw, not anyone's recording. Phase
0 is the foot's own contact, phase 1 its next. They are in degrees, signs OpenSim's.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from solver.common.gravity import GRAVITY
from solver.simulate.contacts import ContactPlan, Stance, TimeHistory
from solver.simulate.feasible_motion import Wish
from solver.simulate.simulated_sole import SIDES, Sole
from solver.skeleton.skeleton import Skeleton

IMPACT_AT, IMPACT_WIDTH = 0.17, 0.06  # of the stance: the lower leg comes to rest
Knots = tuple[tuple[float, float], ...]

WALKING_LEG: Mapping[str, Knots] = {
    "hip_flexion": ((0, 27), (0.12, 23), (0.3, 3), (0.5, -13), (0.62, -4), (0.75, 18), (0.87, 29)),
    "hip_adduction": ((0, -1), (0.15, 5), (0.35, 3), (0.5, 1), (0.63, -6), (0.8, -3)),
    "hip_rotation": ((0, -2), (0.2, 3), (0.5, 1), (0.65, -3), (0.85, -1)),
    "knee_angle": (
        (0, 5),
        (0.13, 17),
        (0.27, 11),
        (0.41, 5),
        (0.52, 12),
        (0.62, 38),
        (0.73, 60),
        (0.87, 27),
        (0.96, 5),
    ),
    "ankle_angle": (
        (0, 1),
        (0.06, -5),
        (0.14, 0),
        (0.3, 6),
        (0.45, 11),
        (0.54, 3),
        (0.63, -17),
        (0.74, -4),
        (0.86, 2),
    ),
    "subtalar_angle": ((0, 2), (0.15, -4), (0.4, -2), (0.6, 6), (0.8, 2)),
    "mtp_angle": ((0, 8), (0.12, 1), (0.38, 1), (0.55, 22), (0.63, 28), (0.72, 14), (0.88, 12)),
}
RUNNING_LEG: Mapping[str, Knots] = {
    "hip_flexion": ((0, 32), (0.12, 24), (0.34, -7), (0.45, -9), (0.6, 15), (0.78, 44), (0.9, 40)),
    "hip_adduction": ((0, 2), (0.14, 7), (0.34, -1), (0.55, -5), (0.8, -2)),
    "hip_rotation": ((0, 0), (0.3, 2), (0.6, -3), (0.85, -1)),
    "knee_angle": ((0, 17), (0.15, 42), (0.34, 20), (0.5, 66), (0.63, 95), (0.8, 58), (0.93, 18)),
    "ankle_angle": ((0, 4), (0.16, 22), (0.27, 8), (0.36, -22), (0.5, -10), (0.7, 3), (0.88, 6)),
    "subtalar_angle": ((0, 5), (0.15, -6), (0.34, 5), (0.6, 4)),
    "mtp_angle": ((0, 10), (0.1, 2), (0.2, 4), (0.32, 25), (0.4, 22), (0.55, 10), (0.85, 12)),
}
SPRINTING_LEG: Mapping[str, Knots] = {
    "hip_flexion": (
        (0, 36),
        (0.12, 16),
        (0.24, -12),
        (0.33, -14),
        (0.48, 20),
        (0.66, 70),
        (0.78, 76),
        (0.9, 56),
    ),
    "hip_adduction": ((0, 1), (0.12, 5), (0.25, 0), (0.5, -4), (0.8, -2)),
    "hip_rotation": ((0, 0), (0.25, 2), (0.6, -3), (0.85, -1)),
    "knee_angle": (
        (0, 24),
        (0.1, 38),
        (0.22, 24),
        (0.32, 52),
        (0.46, 114),
        (0.56, 124),
        (0.7, 96),
        (0.88, 24),
    ),
    "ankle_angle": ((0, 2), (0.1, 20), (0.17, 6), (0.24, -24), (0.36, -18), (0.55, 0), (0.85, 6)),
    "subtalar_angle": ((0, 4), (0.1, -5), (0.24, 5), (0.6, 3)),
    "mtp_angle": ((0, 12), (0.06, 14), (0.14, 20), (0.23, 32), (0.34, 16), (0.6, 8), (0.88, 10)),
}


@dataclass(frozen=True)
class GaitStyle:
    """How someone walks or runs. Shares of a stance count from 0 (contact) to 1 (toe-off)."""

    leg: Mapping[str, Knots]
    stance_share: float  # of the cycle
    step_width: float  # [m]
    toe_out_deg: float
    heel_planted: tuple[float, float]
    forefoot_planted: tuple[float, float]
    harmonics: tuple[float, ...]  # of the vertical force over the stance: sin πs, sin 3πs, …
    braking: float  # fore-aft force over vertical force at contact, and with the other sign at toe-off
    along: tuple[tuple[float, float], ...]  # centre of pressure along the sole over the stance
    trunk_lean_deg: float
    elbow_deg: float
    arm_swing_deg: float
    brace: float  # body weights; see `ContactPlan`
    pelvis_tilt_deg: float
    sway: float  # [m] of the pelvis towards the standing foot
    lowest: float  # when the pelvis is lowest, as a share of the step
    pattern_step: float | None  # [m] step length of the angle pattern; None: it serves for all
    pelvis_drop: float  # of stature, below upright stance
    bounce: float  # [m] half the rise and fall of the pelvis
    impact: float = 0.0  # height of the vertical force's early spike against its main wave
    ease: float = 0.12  # of the stance, over which the force grows and vanishes


WALKING = GaitStyle(
    leg=WALKING_LEG,
    stance_share=0.62,
    step_width=0.10,
    toe_out_deg=7.0,
    heel_planted=(0.05, 0.57),
    forefoot_planted=(0.17, 0.92),
    harmonics=(1.0, 0.30, 0.05),
    braking=0.22,
    along=((0.0, 0.08), (0.08, 0.13), (0.25, 0.33), (0.5, 0.50), (0.75, 0.68), (0.92, 0.80), (1.0, 0.86)),
    trunk_lean_deg=-4.0,
    elbow_deg=25.0,
    arm_swing_deg=17.0,
    brace=0.45,
    pelvis_tilt_deg=-6.0,
    sway=0.018,
    lowest=0.0,
    pattern_step=0.70,
    pelvis_drop=0.014,
    bounce=0.018,
)
RUNNING = GaitStyle(
    leg=RUNNING_LEG,
    stance_share=0.36,
    step_width=0.05,
    toe_out_deg=6.0,
    heel_planted=(0.12, 0.50),
    forefoot_planted=(0.16, 0.90),
    harmonics=(1.0, -0.05),
    braking=0.28,
    along=((0.0, 0.30), (0.15, 0.36), (0.4, 0.52), (0.7, 0.68), (1.0, 0.78)),
    trunk_lean_deg=-9.0,
    elbow_deg=88.0,
    arm_swing_deg=28.0,
    brace=0.0,
    pelvis_tilt_deg=-10.0,
    sway=0.006,
    lowest=0.12,
    pattern_step=None,
    pelvis_drop=0.035,
    bounce=0.03,
)
SPRINTING = GaitStyle(
    leg=SPRINTING_LEG,
    stance_share=0.24,
    step_width=0.06,
    toe_out_deg=5.0,
    heel_planted=(0.5, 0.5),  # never: sprinters stay on the forefoot
    forefoot_planted=(0.12, 0.88),
    harmonics=(1.0, 0.02),
    braking=0.20,
    along=((0.0, 0.66), (0.2, 0.70), (0.6, 0.76), (1.0, 0.84)),
    trunk_lean_deg=-8.0,
    elbow_deg=88.0,
    arm_swing_deg=45.0,
    brace=0.0,
    pelvis_tilt_deg=-10.0,
    sway=0.004,
    lowest=0.08,
    pattern_step=None,
    pelvis_drop=0.03,
    bounce=0.025,
    impact=0.35,
    ease=0.08,
)
STYLES = {"walk": WALKING, "run": RUNNING, "sprint": SPRINTING}


@dataclass(frozen=True)
class Steps:
    """Contacts in order, left and right in turn, along +x from the origin."""

    times: Float[np.ndarray, " steps"]  # [s]
    feet: tuple[int, ...]
    positions: Float[np.ndarray, "steps 2"]  # (x, z) of the ankle's place on the ground [m]
    yaws: Float[np.ndarray, " steps"]  # [rad]


@dataclass(frozen=True)
class Pace:
    """How fast, and how long each step takes on average."""

    speed: float  # [m/s]
    step_time: float  # [s]


def natural_pace(speed: float, stature: float, style: GaitStyle) -> Pace:
    """The step time that people choose at a speed [m/s].

    Walking: step rate grows as speed^0.42 (Grieve DW, Gear RJ. Ergonomics 1966; 5: 379-399), 1.85 Hz at
    1.3 m/s and 1.75 m. Running: 2.75 Hz at 3 m/s, rising slowly (Cavanagh PR, Kram R. Med Sci Sports Exerc
    1989; 21: 467-479). Sprinting: 4.3 Hz at 9 m/s (Dorn TW et al. J Exp Biol 2012; 215: 1944-1956). All scale
    with the root of stature, like a pendulum.
    """
    if style is WALKING:
        rate = 1.85 * (speed / 1.3) ** 0.42
    else:
        rate = 4.3 * (speed / 9.0) ** 0.41 if style is SPRINTING else 2.75 * (speed / 3.0) ** 0.15
    return Pace(speed, float(np.sqrt(stature / 1.75) / rate))


def at_pace(style: GaitStyle, pace: Pace, stature: float) -> GaitStyle:
    """The style with the stance that goes with a pace.

    Walkers stand 62 % of the cycle at 1.3 m/s and some 4 % less for each m/s more (Murray MP et al. Arch Phys
    Med Rehabil 1984; 65: 65-70). A runner's body travels no farther over the foot than the leg's length
    allows, 0.85 m at a stature of 1.75 m.
    """
    if style is WALKING:
        share = style.stance_share - 0.04 * (pace.speed - 1.3)
    else:
        share = min(style.stance_share, 0.85 * stature / 1.75 / (pace.speed * 2 * pace.step_time))
    return replace(style, stance_share=float(share))


def plan_steps(
    style: GaitStyle,
    pace: Pace,
    span: tuple[float, float],
    rng: np.random.Generator,
    variation: float,
) -> Steps:
    """Steps from before until after a span of time; x = 0 is under the body at time 0.

    Args:
        style: of the gait.
        pace: speed and step time.
        span: first and last time that the motion needs [s].
        rng: of the step-to-step variation.
        variation: relative standard deviation of step time and step length; half of it, in metres, is that of
            the step width.
    """
    step_time, step_length = pace.step_time, pace.speed * pace.step_time
    reach = 2 * step_time + style.stance_share * 2 * step_time
    first = int(np.floor((span[0] - reach) / step_time))
    count = int(np.ceil((span[1] + reach) / step_time)) - first
    index = first + np.arange(count)
    late = 0.3 * step_time  # a contact is not at time 0
    times = late + step_time * (index + variation * rng.standard_normal(count))
    along = pace.speed * times + step_length * (0.5 + variation * rng.standard_normal(count))
    feet = tuple(int(k % 2) for k in index)
    side = np.array([1.0 if SIDES[foot] == "r" else -1.0 for foot in feet])
    across = side * style.step_width / 2 + 0.5 * variation * rng.standard_normal(count)
    yaws = -side * np.radians(style.toe_out_deg + 50 * variation * rng.standard_normal(count))
    return Steps(times, feet, np.stack([along, across], axis=1), yaws)


def gait_contacts(style: GaitStyle, steps: Steps, sole: Sole, mass: float, step_time: float) -> ContactPlan:
    """Stances of a row of steps, each carrying the body's weight for its part of the time."""
    duration = style.stance_share * 2 * step_time
    stances = []
    for k in range(1, len(steps.times) - 1):
        start = float(steps.times[k])
        end = start + duration
        foot = steps.feet[k]
        yaw = float(steps.yaws[k])
        forward = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
        ankle = np.array([steps.positions[k, 0], 0.0, steps.positions[k, 1]])
        impulse = mass * GRAVITY * (steps.times[k + 1] - steps.times[k - 1]) / 2
        stances.append(
            Stance(
                foot=foot,
                start=start,
                end=end,
                origin_ground=ankle - sole.ankle * forward,
                yaw=yaw,
                load=_load(style, impulse, start, duration),
                along=_curve(style.along, start, duration),
                across=_curve(((0.0, 0.0), (0.3, 0.18), (0.6, 0.12), (1.0, -0.2)), start, duration),
                heel_planted=(
                    start + style.heel_planted[0] * duration,
                    start + style.heel_planted[1] * duration,
                ),
                forefoot_planted=(
                    start + style.forefoot_planted[0] * duration,
                    start + style.forefoot_planted[1] * duration,
                ),
            )
        )
    return ContactPlan(tuple(stances), sole, style.brace * mass * GRAVITY)


def gait_wish(
    skeleton: Skeleton,
    style: GaitStyle,
    steps: Steps,
    contacts: ContactPlan,
    times: Float[np.ndarray, " times"],
) -> Wish:
    """What the body should look like at those times."""
    count = CubicSpline(steps.times, np.arange(len(steps.times)))(times)  # steps so far
    right_first = steps.feet[0]  # 0: even steps are right ones
    phase = {"r": (count - right_first) / 2, "l": (count - (1 - right_first)) / 2}
    stretch = _stretch(style, steps)
    columns = _angles(style, phase, stretch)
    columns |= _pelvis_path(skeleton, style, steps, times, phase["r"])
    q = np.stack([columns[name] for name in skeleton.dofs], axis=1)

    loads = contacts.loads(times)
    force = np.zeros((len(times), 3))
    force[:, 1] = loads.sum(axis=1)
    for stance in contacts.stances:
        on = stance.covers(times)
        share = (times[on] - stance.start) / (stance.end - stance.start)
        side = 1.0 if SIDES[stance.foot] == "r" else -1.0
        load = loads[on, stance.foot]
        force[on, 0] -= style.braking * load * np.cos(np.pi * share)
        force[on, 2] -= side * 0.05 * load
    return Wish(
        times=times,
        q=q,
        tolerance=np.array([_tolerance(name) for name in skeleton.dofs]),
        contacts=contacts,
        force=force,
        force_tolerance=0.05,
    )


def _stretch(style: GaitStyle, steps: Steps) -> float:
    """How far the swing of hips and arms departs from the pattern's."""
    if style.pattern_step is None:
        return 1.0
    return float(np.clip(np.mean(np.diff(steps.positions[:, 0])) / style.pattern_step, 0.5, 1.6))


def _angles(style: GaitStyle, phase: Mapping[str, np.ndarray], stretch: float) -> dict[str, np.ndarray]:
    right = phase["r"]
    columns: dict[str, np.ndarray] = {
        "lumbar_extension": wave(2 * right, style.trunk_lean_deg, 1.0, 0.1),
        "lumbar_bending": wave(right, 0.0, -4.0, 0.15),
        "lumbar_rotation": wave(right, 0.0, 8.0 * stretch, 0.0),
    }
    for side in SIDES:
        for name, knots in style.leg.items():
            columns[f"{name}_{side}"] = pattern(knots, phase[side]) * (
                stretch if name == "hip_flexion" else 1.0
            )
        swing = style.arm_swing_deg * stretch
        columns[f"arm_flex_{side}"] = wave(phase[side], -2.0, -swing, 0.03)
        columns[f"arm_add_{side}"] = wave(phase[side], -8.0, 1.5)
        columns[f"arm_rot_{side}"] = wave(phase[side], 8.0, 3.0)
        columns[f"elbow_flex_{side}"] = wave(phase[side], style.elbow_deg, -0.5 * swing, 0.1)
        columns[f"pro_sup_{side}"] = wave(phase[side], 95.0, 4.0)
        columns[f"wrist_flex_{side}"] = wave(phase[side], 6.0, 3.0, 0.2)
        columns[f"wrist_dev_{side}"] = wave(phase[side], 2.0, 2.0, 0.3)
    return columns


def _pelvis_path(
    skeleton: Skeleton, style: GaitStyle, steps: Steps, times: np.ndarray, phase: np.ndarray
) -> dict[str, np.ndarray]:
    hip = skeleton.joints[skeleton.body_index("femur_r")].p_parent_frame
    upright = skeleton.default_q[skeleton.dofs.index("pelvis_ty")]
    over_foot = steps.times + 0.46 * style.stance_share * 2 * float(np.mean(np.diff(steps.times)))
    x = CubicSpline(over_foot, steps.positions[:, 0])(times) - hip[0]
    between = (steps.positions[1:, 1] + steps.positions[:-1, 1]) / 2
    z = CubicSpline(steps.times[1:], between)(times) + style.sway * np.sin(2 * np.pi * (phase - 0.06))
    y = (
        upright
        - style.pelvis_drop * stature_of(skeleton)
        - style.bounce * np.cos(4 * np.pi * (phase - style.lowest / 2))
    )
    return {
        "pelvis_tilt": wave(2 * phase, style.pelvis_tilt_deg, 1.0),
        "pelvis_list": wave(phase, 0.0, 4.0, 0.15),
        "pelvis_rotation": wave(phase, 0.0, 4.0, 0.0),
        "pelvis_tx": x,
        "pelvis_ty": y,
        "pelvis_tz": z,
    }


def stature_of(skeleton: Skeleton) -> float:
    """Stature of the default body, back from its thigh (0.245 of it) [m]."""
    return float(-skeleton.joints[skeleton.body_index("tibia_r")].p_parent_frame[1] / 0.245)


def _tolerance(dof: str) -> float:
    """How far the motion may leave the pattern [rad or m]."""
    if dof in ("pelvis_tx", "pelvis_ty", "pelvis_tz"):
        return 0.03
    loose = ("hip", "knee", "ankle", "subtalar", "mtp")
    return float(np.radians(6.0 if dof.startswith(loose) else 2.5))


def _load(style: GaitStyle, impulse: float, start: float, duration: float) -> TimeHistory:
    """Vertical force over a stance: odd sines, eased in and out, scaled to the impulse."""
    fine = np.linspace(0, 1, 401)

    def shape(share: np.ndarray) -> np.ndarray:
        waves = sum(a * np.sin((2 * k + 1) * np.pi * share) for k, a in enumerate(style.harmonics))
        waves = waves + style.impact * np.exp(-0.5 * ((share - IMPACT_AT) / IMPACT_WIDTH) ** 2)
        edge = np.clip(np.minimum(share, 1 - share) / style.ease, 0, 1)
        return waves * edge * edge * (3 - 2 * edge)

    peak = impulse / duration / float(np.mean(shape(fine)))
    return lambda times: peak * shape((times - start) / duration)


def _curve(knots: tuple[tuple[float, float], ...], start: float, duration: float) -> TimeHistory:
    through = CubicSpline(*np.array(knots).T)
    return lambda times: through((times - start) / duration)


def pattern(knots: Knots, phase: Float[np.ndarray, " times"]) -> Float[np.ndarray, " times"]:
    """The periodic curve through the knots (phase, degrees), in radians."""
    x = np.array([knot[0] for knot in knots] + [knots[0][0] + 1])
    y = np.array([knot[1] for knot in knots] + [knots[0][1]])
    return np.radians(CubicSpline(x, y, bc_type="periodic")(np.mod(phase, 1.0)))


def wave(
    phase: Float[np.ndarray, " times"], mean_deg: float, amplitude_deg: float, peak: float = 0.0
) -> np.ndarray:
    """A cosine over the cycle: mean + amplitude · cos 2π(phase − peak), in radians."""
    return np.radians(mean_deg + amplitude_deg * np.cos(2 * np.pi * (phase - peak)))
