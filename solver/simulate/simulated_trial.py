"""One synthetic trial: a person moves, and the ground answers just as F = ma demands.

The required wrench is shared by the feet: a force at a centre of pressure, and a free vertical moment.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from solver.kinematics.motion import Motion
from solver.simulate.contacts import ContactPlan, about_vertical
from solver.simulate.feasible_motion import PLACE, QUICK, Wish, fit_trajectory
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.landing import drop_of, landing_contacts, landing_wish, times_about_contact
from solver.simulate.person import TrueBody
from solver.simulate.posture import BENT, bend_depth, posture_wish, standing_contacts
from solver.simulate.spline_motion import SplineMotion
from solver.simulate.walk_and_run import (
    STYLES,
    GaitStyle,
    at_pace,
    gait_contacts,
    gait_wish,
    natural_pace,
    plan_steps,
    stature_of,
)
from solver.skeleton.forward import cross
from solver.skeleton.pinocchio_model import RigidBodyModel

External = Callable[[SplineMotion, Float[np.ndarray, " times"]], Float[np.ndarray, "times 6"]]


@dataclass(frozen=True)
class GroundReactions:
    """What the ground does to each foot (right, left); their sum is the demand, exactly."""

    times: Float[np.ndarray, " times"]  # [s]
    force_ground: Float[np.ndarray, "times feet 3"]  # [N]
    cop_ground: Float[np.ndarray, "times feet 3"]  # [m] on the ground plane; NaN while unloaded
    free_moment: Float[np.ndarray, "times feet"]  # [N·m] about the vertical through the centre of pressure

    @property
    def wrench_ground(self) -> Float[np.ndarray, "times feet 6"]:
        """Force [N] and moment about the ground origin [N·m] on each foot."""
        moment = cross(np.nan_to_num(self.cop_ground), self.force_ground)
        moment[..., 1] += self.free_moment
        return np.concatenate([self.force_ground, moment], axis=2)


def share_demand(
    demand_ground: Float[np.ndarray, "times 6"],
    plan: ContactPlan,
    times: Float[np.ndarray, " times"],
) -> GroundReactions:
    """Split a demand so that nothing of it is lost.

    Each foot in contact takes its planned share of the force. Where the demand acts beside the planned centre
    of pressure, the feet's centres of pressure shift alike by that distance. What moment is left about the
    vertical is shared like the force. A foot in front brakes while the one behind pushes: a pair of opposite
    forces along the line between their centres of pressure, which the body doesn't notice.

    Args:
        demand_ground: force [N] and moment about the ground origin [N·m].
        plan: who stands where.
        times: of the demand [s].
    """
    shares = plan.shares(times)
    wanted = np.nan_to_num(plan.centres_of_pressure(times))
    force, moment = demand_ground[:, :3], demand_ground[:, 3:]
    loaded = shares.sum(axis=1) > 0
    vertical = np.where(loaded, force[:, 1], 1.0)
    acts_at = np.stack([moment[:, 2], np.zeros(len(times)), -moment[:, 0]], axis=1) / vertical[:, None]
    beside = np.where(loaded[:, None], acts_at - np.einsum("tf,tfi->ti", shares, wanted), 0.0)
    cop = wanted + beside[:, None]
    feet_force = shares[:, :, None] * force[:, None]

    apart = cop[:, 0] - cop[:, 1]
    distance = np.linalg.norm(apart, axis=1, keepdims=True)
    towards_right = np.divide(apart, distance, out=np.zeros_like(apart), where=distance > 0)
    inner = plan.brace * shares[:, :1] * shares[:, 1:] * towards_right
    feet_force[:, 0] -= inner
    feet_force[:, 1] += inner

    left_over = moment[:, 1] - cross(cop, feet_force)[..., 1].sum(axis=1)
    return GroundReactions(
        times=times,
        force_ground=np.where(loaded[:, None, None], feet_force, 0.0),
        cop_ground=np.where(shares[:, :, None] > 0, cop, np.nan),
        free_moment=np.where(shares > 0, shares * left_over[:, None], 0.0),
    )


"""What does not come from the ground, along a motion: force [N], moment about the ground origin [N·m]."""

Activity = Literal["walk", "run", "sprint", "squat", "stand", "landing", "bounce", "arms", "bend", "shift"]
GRID = {"sprint": 0.005, "landing": 0.005}  # [s] of the fit; of others:
USUAL_GRID = 0.01  # [s]; knots lie on the grid, so that frames of 100 Hz and its multiples meet them
KNOTS = {"walk": 0.03, "run": 0.01, "sprint": 0.005, "stand": 0.05, "shift": 0.05, "landing": 0.005}  # [s]
BENDING_KNOTS = 0.03  # [s] of who bends
SPEED = {"walk": 1.3, "run": 3.2, "sprint": 8.5}  # [m/s] where the scenario names none
SHIFT = 0.35  # of the load, from one foot to the other and back
EXTERNAL_ROUNDS = 3  # of fitting to an external wrench that depends on the motion
MARGIN = 0.3  # [s] simulated before and after the recording, where the ends of the spline are loose


@dataclass(frozen=True)
class Scenario:
    """What happens in a trial."""

    name: str
    activity: Activity
    duration: float = 4.0  # [s]
    speed: float | None = None  # [m/s] of walking, running or sprinting; None: 1.3, 3.2 and 8.5
    heading_deg: float = 0.0  # of progression, about +y from +x
    centre: tuple[float, float] = (0.0, 0.0)  # (x, z) that the person passes, or stands at [m]
    variation: float = 0.015  # step-to-step, relative
    style: GaitStyle | None = None  # of walking, running or sprinting; None: as most people do
    width: float | None = None  # [m] between the midlines of who stands; None: as people do
    cadence: float = 1.0  # steps a second over those that most people of that stature take at that speed


@dataclass(frozen=True)
class SyntheticTrial:
    """The truth of one trial."""

    scenario: Scenario
    body: TrueBody
    motion: SplineMotion
    contacts: ContactPlan
    external: External | None = None

    def frames(self, rate: float) -> Motion:
        """The motion sampled from time 0 to the trial's end."""
        times = np.arange(round(self.scenario.duration * rate) + 1) / rate
        return Motion(self.motion.dofs, self.motion.derivative(times, 0), rate)

    def demand(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 6"]:
        """What the motion demands of the ground: force [N], moment about the ground origin [N·m]."""
        demand = GroundDemand(RigidBodyModel(self.body.skeleton)).wrench(*self.motion.state(times))
        return demand - self.external(self.motion, times) if self.external else demand

    def reactions(self, times: Float[np.ndarray, " times"]) -> GroundReactions:
        """What the ground does to each foot."""
        return share_demand(self.demand(times), self.contacts, times)


def simulate_trial(
    scenario: Scenario, body: TrueBody, rng: np.random.Generator, external: External | None = None
) -> SyntheticTrial:
    """Let a person do what the scenario says.

    Args:
        scenario: of the trial.
        body: whose.
        rng: of the steps and the sway.
        external: what acts on the person besides gravity and the ground (a support, a tether), if anything;
            the person leans so that the ground still acts under the feet.
    """
    span = (-MARGIN, scenario.duration + MARGIN)
    grid = GRID.get(scenario.activity, USUAL_GRID)
    times = span[0] + grid * np.arange(int(np.ceil((span[1] - span[0]) / grid - 1e-9)) + 1)
    wish = _place(_wish(scenario, body, times, rng), body, scenario)
    model, knots = RigidBodyModel(body.skeleton), KNOTS.get(scenario.activity, BENDING_KNOTS)
    settings = QUICK if scenario.activity in GRID else None
    motion = fit_trajectory(wish, model, knots, settings)
    for _ in range(EXTERNAL_ROUNDS if external else 0):
        assert external
        motion = fit_trajectory(
            replace(wish, external=external(motion, wish.times)), model, knots, settings, start=motion
        )
    return SyntheticTrial(scenario, body, motion, wish.contacts, external)


def _wish(scenario: Scenario, body: TrueBody, times: np.ndarray, rng: np.random.Generator) -> Wish:
    if scenario.activity in STYLES:
        return _gait(scenario, body, times, rng)
    if scenario.activity == "landing":
        return _landing(body, times, rng)
    return _posture(scenario, body, times, rng)


def _gait(scenario: Scenario, body: TrueBody, times: np.ndarray, rng: np.random.Generator) -> Wish:
    speed = scenario.speed if scenario.speed is not None else SPEED[scenario.activity]
    stature = stature_of(body.skeleton)
    usual = STYLES[scenario.activity]
    own = scenario.style or usual
    natural = natural_pace(speed, stature, usual)
    pace = replace(natural, step_time=natural.step_time / scenario.cadence)
    longer = own.stance_share - usual.stance_share
    style = replace(own, stance_share=at_pace(usual, pace, stature).stance_share + longer)
    steps = plan_steps(style, pace, (times[0], times[-1]), rng, scenario.variation)
    middle = speed * scenario.duration / 2
    steps = replace(steps, positions=steps.positions - (middle, 0.0))
    contacts = gait_contacts(style, steps, body.sole, body.skeleton.mass, pace.step_time)
    if scenario.activity == "run":
        times = _with_edges(times, contacts)
    elif scenario.activity == "sprint":
        times = _with_loading(times, contacts)
    return gait_wish(body.skeleton, style, steps, contacts, times)


def _with_edges(times: np.ndarray, contacts: ContactPlan) -> np.ndarray:
    """The grid with the ends of flight, where the demand has to vanish too, but those next to its times."""
    edges = np.array([edge for stance in contacts.stances for edge in (stance.start, stance.end)])
    return _join_times(times, edges)


def _with_loading(times: np.ndarray, contacts: ContactPlan) -> np.ndarray:
    """Also times, four to a grid interval, at which the load of a short stance begins and ends."""
    near = (times[1] - times[0]) / 4 * np.arange(1, 12)
    inside = [edge for s in contacts.stances for edge in (*(s.start + near), *(s.end - near))]
    return _join_times(_with_edges(times, contacts), np.array(inside), 0.25 * near[0])


def _join_times(times: np.ndarray, more: np.ndarray, apart: float | None = None) -> np.ndarray:
    """Times with others between them, but those that are too near to one [s]; None: a quarter of a step."""
    least = 0.25 * (times[1] - times[0]) if apart is None else apart
    more = more[(more > times[0]) & (more < times[-1])]
    return np.union1d(times, more[np.abs(more[:, None] - times).min(axis=1) > least])


def _landing(body: TrueBody, times: np.ndarray, rng: np.random.Generator) -> Wish:
    hip = body.skeleton.joints[body.skeleton.body_index("femur_r")].p_parent_frame
    drop = drop_of(rng)
    contacts = landing_contacts(drop, body.sole, body.skeleton.mass, 2.6 * hip[2], float(times[-1]))
    looked_at = _join_times(times, times_about_contact(drop), 1e-9)
    return landing_wish(body.skeleton, contacts, drop, looked_at)


def _posture(scenario: Scenario, body: TrueBody, times: np.ndarray, rng: np.random.Generator) -> Wish:
    span = (float(times[0]), float(times[-1]))
    hip = body.skeleton.joints[body.skeleton.body_index("femur_r")].p_parent_frame
    squats = scenario.activity == "squat"
    width = scenario.width or (3.2 if squats else 2.4) * hip[2]
    shift = SHIFT if scenario.activity == "shift" else 0.0
    contacts = standing_contacts(body.sole, body.skeleton.mass, width, span, rng, shift=shift)
    bend = BENT.get(scenario.activity)
    if bend is None:
        return posture_wish(body.skeleton, contacts, times, None)
    return posture_wish(body.skeleton, contacts, times, bend_depth(bend, span, rng)(times), bend)


def _place(wish: Wish, body: TrueBody, scenario: Scenario) -> Wish:
    """The wish turned to its heading and carried to its place."""
    heading = np.radians(scenario.heading_deg)
    by = np.array([scenario.centre[0], 0.0, scenario.centre[1]])
    dofs = body.skeleton.dofs
    angles = [dofs.index(name) for name in ("pelvis_tilt", "pelvis_list", "pelvis_rotation")]
    places = [dofs.index(name) for name in PLACE]
    turn = Rotation.from_matrix(about_vertical(heading))
    q = wish.q.copy()
    if heading:
        q[:, angles] = np.unwrap((turn * Rotation.from_euler("ZXY", q[:, angles])).as_euler("ZXY"), axis=0)
    q[:, places] = turn.apply(q[:, places]) + by
    return replace(wish, q=q, contacts=wish.contacts.moved(heading, by), force=turn.apply(wish.force))
