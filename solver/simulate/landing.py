"""Landing on both feet from a box: in flight from the first frame, forefoot first, then down and up again."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.gravity import GRAVITY
from solver.simulate.contacts import ContactPlan, Stance
from solver.simulate.feasible_motion import Wish
from solver.simulate.posture import STANDING, tolerance_of
from solver.simulate.simulated_sole import Sole
from solver.skeleton.skeleton import Skeleton

FINE = 2000.0  # [Hz] of the path's integration
REACH_KNEE_DEG, REACH_FOOT_DEG = 20.0, 25.0  # at contact: bent knee, toes pointed down
HEEL_DOWN_S = 0.05  # after the forefoot
FIRST_LOAD_S = 0.016  # within which the ground takes the weight
GRID = 0.005  # [s] contact is on it
STOPPED_S, RISE_S = 0.34, 0.9  # from contact to the lowest point; from there to standing
SPIKE_S, SPIKE_WIDTH_S = 0.045, 0.018  # when the heel strikes, and how briefly
CATCH_S, CATCH_WIDTH_S = 0.10, 0.06  # of the muscles' part


@dataclass(frozen=True)
class Drop:
    """How somebody comes off the box.

    With a spike of 2.4 body weights both feet together bear some 4 body weights about 45 ms after contact, as
    in people who land from 0.3 to 0.4 m (Zhang SN et al. Med Sci Sports Exerc 2000; 32: 812-819).
    """

    height_m: float  # from which the centre of mass falls
    forward_m_s: float
    spike: float  # [body weights] of the impact
    contact: float  # [s]


def drop_of(rng: np.random.Generator) -> Drop:
    """From a box of some 0.35 m; time 0 is when the feet have just left it."""
    height = 0.35 * (1 + 0.06 * float(rng.standard_normal()))
    return Drop(
        height_m=height,
        forward_m_s=0.4 * (1 + 0.1 * float(rng.standard_normal())),
        spike=2.4 * (1 + 0.08 * float(rng.standard_normal())),
        contact=GRID * round(float(np.sqrt(2 * height / GRAVITY)) / GRID),
    )


@dataclass(frozen=True)
class CentreOfMass:
    """Its wanted time history, relative to where it stands in the end."""

    rise: Float[np.ndarray, " times"]  # [m] above standing
    ahead: Float[np.ndarray, " times"]  # [m]
    acceleration: Float[np.ndarray, "times 3"]  # [m/s²]


def fall(drop: Drop, above_at_contact: float, times: Float[np.ndarray, " times"]) -> CentreOfMass:
    """Ballistic until contact; stopped by a spike and a slower catch; then up to standing, smoothly.

    Args:
        drop: of the person.
        above_at_contact: height at contact over that in standing [m].
        times: [s].
    """
    after = np.arange(0.0, STOPPED_S, 1 / FINE)
    speed = GRAVITY * drop.contact
    spike, catch = _bump(after, SPIKE_S, SPIKE_WIDTH_S), _bump(after, CATCH_S, CATCH_WIDTH_S)
    sink = drop.spike * GRAVITY * spike - GRAVITY * (1 - _begun(after))
    caught = (speed - sink.sum() / FINE) / (catch.sum() / FINE)  # what the spike leaves is caught
    braked = sink + caught * catch
    falling = speed - np.cumsum(braked) / FINE
    path = above_at_contact - np.cumsum(falling) / FINE
    slowing = drop.forward_m_s * braked / speed
    forward = np.cumsum(drop.forward_m_s - np.cumsum(slowing) / FINE) / FINE
    share = np.clip((times - drop.contact - STOPPED_S) / RISE_S, 0, 1)
    up = share**3 * (10 - 15 * share + 6 * share**2)
    up_rate = (60 * share - 180 * share**2 + 120 * share**3) / RISE_S**2
    t, flying = times - drop.contact, times < drop.contact
    stopping = ~flying & (t < STOPPED_S)
    rise = np.where(flying, above_at_contact - speed * t - GRAVITY * t**2 / 2, path[-1] * (1 - up))
    rise[stopping] = np.interp(t[stopping], after, path)
    ahead = np.where(flying, drop.forward_m_s * t - forward[-1], 0.0)
    ahead[stopping] = np.interp(t[stopping], after, forward) - forward[-1]
    acceleration = np.zeros((len(times), 3))
    acceleration[:, 1] = np.where(flying, -GRAVITY, -path[-1] * up_rate)
    acceleration[stopping, 1] = np.interp(t[stopping], after, braked)
    acceleration[stopping, 0] = -np.interp(t[stopping], after, slowing)
    return CentreOfMass(rise, ahead, acceleration)


def times_about_contact(drop: Drop) -> Float[np.ndarray, " times"]:
    """Times [s], four to a grid interval, at which a fit has to look as the load begins."""
    return drop.contact + GRID / 4 * np.arange(33)


def landing_contacts(drop: Drop, sole: Sole, mass: float, width: float, until: float) -> ContactPlan:
    """Both feet from contact on: pressure under the forefoot, then under the whole sole.

    Args:
        drop: of the person.
        sole: likewise.
        mass: [kg].
        width: between the feet's midlines [m].
        until: last time [s].
    """
    start, end = drop.contact, until + 1.0
    stances = []
    for foot, side in enumerate((1.0, -1.0)):

        def load(times: np.ndarray, side: float = side) -> np.ndarray:
            return mass * GRAVITY * (0.5 + 0.02 * side) * _begun(times - start)

        def along(times: np.ndarray) -> np.ndarray:
            return 0.45 + 0.27 * np.exp(-np.maximum(times - start, 0) / 0.04)

        stances.append(
            Stance(
                foot=foot,
                start=start,
                end=end,
                origin_ground=np.array([-sole.ankle, 0.0, side * width / 2]),
                yaw=-side * np.radians(8.0),
                load=load,
                along=along,
                across=lambda times: np.full(len(times), 0.05),
                heel_planted=(start + HEEL_DOWN_S, end),
                forefoot_planted=(start + 0.01, end),
            )
        )
    return ContactPlan(tuple(stances), sole)


def landing_wish(
    skeleton: Skeleton, contacts: ContactPlan, drop: Drop, times: Float[np.ndarray, " times"]
) -> Wish:
    """What the body should look like: legs by the hips' height over the ankles, trunk leaning with depth."""
    sole = contacts.sole
    hip = skeleton.joints[skeleton.body_index("femur_r")].p_parent_frame
    thigh = -skeleton.joints[skeleton.body_index("tibia_r")].p_parent_frame[1]
    shank = -skeleton.joints[skeleton.body_index("talus_r")].p_parent_frame[1]
    standing = skeleton.default_q[skeleton.dofs.index("pelvis_ty")] - 0.002
    foot = np.radians(REACH_FOOT_DEG) * (1 - np.clip((times - drop.contact) / HEEL_DOWN_S, 0, 1))
    lifted = (sole.ball - sole.ankle) * np.sin(foot)
    bent = _straight(thigh, shank, np.radians(REACH_KNEE_DEG)) - (thigh + shank)
    com = fall(drop, float(bent + lifted[0]), times)
    depth = np.clip(-com.rise / 0.3, 0, 1)
    reach = np.where(times < drop.contact, thigh + shank + bent, thigh + shank + com.rise - lifted)
    reach = np.minimum(reach, _straight(thigh, shank, np.radians(3.0)))
    knee = np.arccos((reach**2 - thigh**2 - shank**2) / (2 * thigh * shank))
    tilt = -np.radians(4 + 22 * depth)
    back = 0.10 * depth  # hips behind the ankles
    forward = np.arcsin(np.clip(shank * np.sin(knee) / reach, -1, 1)) + np.arctan2(back, reach)
    columns = {
        "pelvis_tilt": tilt,
        "pelvis_tx": -hip[0] + 0.02 - back + com.ahead,
        "pelvis_ty": standing + com.rise,
        "hip_flexion": forward - tilt,
        "hip_adduction": -np.radians(3 + 5 * depth),
        "knee_angle": knee,
        "ankle_angle": knee - forward - foot,
        "mtp_angle": 0.8 * foot * (times >= drop.contact),
        "lumbar_extension": -np.radians(4 + 14 * depth),
        "arm_flex": np.radians(20 + 35 * depth),
        "arm_add": np.full(len(times), -np.radians(18)),
        "elbow_flex": np.full(len(times), np.radians(35)),
    }
    q = np.zeros((len(times), len(skeleton.dofs)))
    for i, dof in enumerate(skeleton.dofs):
        stem = dof[:-2] if dof.endswith(("_r", "_l")) else dof
        q[:, i] = columns.get(stem, np.full(len(times), np.radians(STANDING.get(stem, 0.0))))
    force = skeleton.mass * (com.acceleration - skeleton.gravity)
    return Wish(
        times=times,
        q=q,
        tolerance=tolerance_of(skeleton, legs_deg=8.0),
        contacts=contacts,
        force=force,
        force_tolerance=0.05,
    )


def _bump(times: Float[np.ndarray, " times"], middle: float, width: float) -> Float[np.ndarray, " times"]:
    """A bell that begins and ends at nothing."""
    end = np.clip((STOPPED_S - times) / 0.05, 0, 1)
    return np.exp(-0.5 * ((times - middle) / width) ** 2) * _begun(times) * end


def _begun(since_contact: Float[np.ndarray, " times"]) -> Float[np.ndarray, " times"]:
    """From nothing at contact to one, smoothly."""
    share = np.clip(since_contact / FIRST_LOAD_S, 0, 1)
    return share**2 * (3 - 2 * share)


def _straight(thigh: float, shank: float, knee: float) -> float:
    """From hip to ankle [m] at a knee's angle [rad]."""
    return float(np.sqrt(thigh**2 + shank**2 + 2 * thigh * shank * np.cos(knee)))
