"""Where joints and body frames of the default body lie (its right side), from the lengths of a person."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.skeleton.segment_tables import ANKLE_ALONG_FOOT, BALL_ALONG_FOOT, Lengths, hip_centre

Point = Float[np.ndarray, "3"]


@dataclass(frozen=True)
class BodyFrames:
    """Origin of each right-hand or central body in its parent's frame, all frames parallel [m].

    Frames are placed as OpenSim's models place theirs; where that is no joint centre (calcn: low at the heel;
    patella: its lower pole) the offset is a proportion of the segment.
    """

    hip_pelvis: Point
    torso_pelvis: Point
    knee_femur: Point
    patella_femur: Point
    ankle_tibia: Point
    calcn_talus: Point
    toes_calcn: Point
    shoulder_torso: Point
    elbow_humerus: Point
    radius_ulna: Point
    wrist_radius: Point
    knuckle_hand: Point
    heel_behind_calcn: float  # back of the heel behind calcn's origin
    calcn_above_sole: float

    @property
    def wrist_ulna(self) -> Point:
        """The wrist's centre in the ulna's frame, forearm supinated [m]."""
        return self.radius_ulna + self.wrist_radius

    def trunk_line(self, above_hips: float) -> Point:
        """Point of the line from mid-hip to mid-shoulder, in the pelvis frame [m]."""
        mid_hip = self.hip_pelvis * (1, 1, 0)
        to_shoulders = (self.torso_pelvis + self.shoulder_torso) * (1, 1, 0) - mid_hip
        return mid_hip + to_shoulders * (above_hips / to_shoulders[1])


def body_frames(of: Lengths) -> BodyFrames:
    """Frames of a person of these lengths.

    The lumbar joint stands at the navel's height, where the tables cut the trunk, two thirds of the pelvic
    depth behind the anterior spines; the shoulders stand 2 cm (at 1.75 m) behind the hips. The forearm turns
    about a line from the radial head to the ulnar head.
    """
    hip = hip_centre(of)
    torso = np.array([-2 / 3 * of.pelvis_depth, hip[1] + of.navel_above_hips, 0.0])
    shoulder = np.array(
        [hip[0] - 0.0115 * of.stature, hip[1] + of.shoulders_above_hips, of.shoulder_half_width]
    )
    wrist_ulna = of.forearm * np.array([0.0, -np.cos(of.carrying_angle), np.sin(of.carrying_angle)])
    radial_head = np.array([0.0, -0.05 * of.forearm, 0.07 * of.forearm])
    return BodyFrames(
        hip_pelvis=hip,
        torso_pelvis=torso,
        knee_femur=np.array([0.0, -of.thigh, 0.0]),
        patella_femur=np.array([0.11 * of.thigh, -1.03 * of.thigh, 0.0]),
        ankle_tibia=np.array([0.0, -of.shank, 0.0]),
        calcn_talus=np.array([-0.185 * of.foot, -0.65 * of.ankle_height, 0.005 * of.stature]),
        toes_calcn=np.array([(BALL_ALONG_FOOT - ANKLE_ALONG_FOOT + 0.185) * of.foot, 0.0, 0.0]),
        shoulder_torso=shoulder - torso,
        elbow_humerus=np.array([0.0, -of.upper_arm, 0.0]),
        radius_ulna=radial_head,
        wrist_radius=wrist_ulna - radial_head,
        knuckle_hand=np.array([0.0, -of.hand, 0.0]),
        heel_behind_calcn=(ANKLE_ALONG_FOOT - 0.185) * of.foot,
        calcn_above_sole=0.35 * of.ankle_height,
    )
