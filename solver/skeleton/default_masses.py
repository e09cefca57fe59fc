"""Mass, centre of mass and inertia of the default body's segments (its right side)."""

import numpy as np

from solver.skeleton.default_frames import BodyFrames
from solver.skeleton.mass_elements import MassElement, box, ellipsoid, segment_element, together, without
from solver.skeleton.segment_tables import BALL_ALONG_FOOT, Lengths, Sex, segment_shape

# A foot whose height falls evenly from the heel to 0.3 of it at the toes holds this share before the ball;
# its centroid then lies at 41 % of the length, between de Leva's 40 % (women) and 44 % (men).
_TIP = 0.3
TOES_SHARE = 1 - (BALL_ALONG_FOOT - (1 - _TIP) * BALL_ALONG_FOOT**2 / 2) / (1 - (1 - _TIP) / 2)
TALUS_SHARE = 0.1  # of the foot: the bone and what surrounds it; no table cuts the foot here
PATELLA_SHARE = 0.001  # of body mass, out of the thigh: the bone and its tendon


def mass_elements(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    """One element for each central or right-hand body, in its frame; left ones are the mirror image.

    Args:
        of: lengths of the person.
        frames: of the same person.
        mass: of the whole person [kg].
        sex: whose tables to take.
    """
    return {
        **_trunk(of, frames, mass, sex),
        **_leg(of, frames, mass, sex),
        **_foot(of, frames, mass, sex),
        **_arm(of, frames, mass, sex),
    }


def _trunk(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    middle, upper = of.trunk_above_navel
    navel = of.navel_above_hips
    ends = {
        "lower_trunk": (navel, 0.0),
        "middle_trunk": (navel + middle, navel),
        "upper_trunk": (navel + middle + upper, navel + middle),
        "head": (of.c7_above_hips + of.head, of.c7_above_hips),
    }
    parts = {
        name: segment_element(
            segment_shape(name, sex), mass, frames.trunk_line(top), frames.trunk_line(bottom)
        )
        for name, (top, bottom) in ends.items()
    }
    above = [parts[name].moved(-frames.torso_pelvis) for name in ("middle_trunk", "upper_trunk", "head")]
    return {"pelvis": parts["lower_trunk"], "torso": together(above)}


def _leg(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    hip = np.zeros(3)
    thigh = segment_element(segment_shape("thigh", sex), mass, hip, frames.knee_femur)
    half_axes = np.array([0.006, 0.013, 0.013]) * of.stature  # a bone of 4.5 cm, 2 cm thick
    patella = ellipsoid(PATELLA_SHARE * mass, np.array([0.0, half_axes[1], 0.0]), half_axes)
    return {
        "femur": without(thigh, [patella.moved(frames.patella_femur)]),
        "patella": patella,
        "tibia": segment_element(segment_shape("shank", sex), mass, np.zeros(3), frames.ankle_tibia),
    }


def _foot(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    shape = segment_shape("foot", sex)
    total = shape.mass * mass
    height = 0.5 * of.ankle_height - frames.calcn_above_sole
    com = np.array([shape.com * of.foot - frames.heel_behind_calcn, height, 0.0])
    # along a foot the tables' longitudinal axis is x and their sagittal axis (across the segment) is z
    radii = of.foot * np.array([shape.radius_longitudinal, shape.radius_transverse, shape.radius_sagittal])
    foot = MassElement(total, com, np.diag(total * radii**2))

    toe_length = (1 - BALL_ALONG_FOOT) * of.foot
    toe_height = 0.4 * of.ankle_height
    toes = box(
        TOES_SHARE * total,
        np.array([0.45 * toe_length, toe_height / 2 - frames.calcn_above_sole, 0.0]),
        np.array([toe_length, toe_height, of.foot_breadth]),
    )
    talus = ellipsoid(TALUS_SHARE * total, np.zeros(3), np.full(3, 0.4 * of.ankle_height))
    parts = [toes.moved(frames.toes_calcn), talus.moved(-frames.calcn_talus)]
    return {"calcn": without(foot, parts), "toes": toes, "talus": talus}


def _arm(of: Lengths, frames: BodyFrames, mass: float, sex: Sex | None) -> dict[str, MassElement]:
    forearm = segment_element(segment_shape("forearm", sex), mass, np.zeros(3), frames.wrist_ulna)
    half = MassElement(forearm.mass / 2, forearm.com, forearm.inertia / 2)  # bones share the forearm evenly
    return {
        "humerus": segment_element(segment_shape("upper_arm", sex), mass, np.zeros(3), frames.elbow_humerus),
        "ulna": half,
        "radius": half.moved(-frames.radius_ulna),
        "hand": segment_element(segment_shape("hand", sex), mass, np.zeros(3), frames.knuckle_hand),
    }
