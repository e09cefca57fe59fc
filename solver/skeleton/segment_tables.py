"""Published tables from which the default body is built: lengths, masses, inertias, joint axes, ranges.

Lengths are fractions of stature, masses fractions of body mass; where a table has two columns they are for
men and women, and a person of unknown sex gets their mean.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

Sex = Literal["male", "female"]


@dataclass(frozen=True)
class SegmentShape:
    """How mass lies along a segment: centre of mass from its first end point, radii of gyration about it.

    All but the mass are fractions of the distance between the segment's end points.
    """

    mass: float  # of body mass
    com: float
    radius_sagittal: float  # about the antero-posterior axis
    radius_transverse: float  # about the medio-lateral axis
    radius_longitudinal: float


# de Leva P. Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters. J Biomech 1996; 29: 1223-1230,
# table 4, percent: mass, centre of mass, sagittal, transverse and longitudinal radius; men, then women. End
# points: head VERT-CERV; upper, middle, lower trunk SUPR-XYPH-OMPH-MIDH; arms SJC-EJC-WJC-MET3; legs
# HJC-KJC-AJC; foot HEEL-TTIP.
_DE_LEVA = {
    "head": ((6.94, 50.02, 30.3, 31.5, 26.1), (6.68, 48.41, 27.1, 29.5, 26.1)),
    "upper_trunk": ((15.96, 29.99, 71.6, 45.4, 65.9), (15.45, 20.77, 74.6, 50.2, 71.8)),
    "middle_trunk": ((16.33, 45.02, 48.2, 38.3, 46.8), (14.65, 45.12, 43.3, 35.4, 41.5)),
    "lower_trunk": ((11.17, 61.15, 61.5, 55.1, 58.7), (12.47, 49.20, 43.3, 40.2, 44.4)),
    "upper_arm": ((2.71, 57.72, 28.5, 26.9, 15.8), (2.55, 57.54, 27.8, 26.0, 14.8)),
    "forearm": ((1.62, 45.74, 27.6, 26.5, 12.1), (1.38, 45.59, 26.1, 25.7, 9.4)),
    "hand": ((0.61, 79.00, 62.8, 51.3, 40.1), (0.56, 74.74, 53.1, 45.4, 33.5)),
    "thigh": ((14.16, 40.95, 32.9, 32.9, 14.9), (14.78, 36.12, 36.9, 36.4, 16.2)),
    "shank": ((4.33, 43.95, 25.1, 24.6, 10.2), (4.81, 43.52, 26.7, 26.3, 9.2)),
    "foot": ((1.37, 44.15, 25.7, 24.5, 12.4), (1.29, 40.14, 29.9, 27.9, 13.9)),
}
# The same paper's mean lengths [mm] of what lies above the hips; men, then women.
_DE_LEVA_LENGTHS_MM = {
    "vertex_to_c7": (242.9, 243.7),
    "c7_to_hips": (603.3, 614.8),
    "sternum_to_xiphoid": (170.7, 142.5),
    "xiphoid_to_navel": (215.5, 205.3),
    "navel_to_hips": (145.7, 181.5),
    "shoulders_to_hips": (515.5, 497.9),
    "shoulder_to_elbow": (281.7, 275.1),
    "elbow_to_wrist": (268.9, 264.3),
    "wrist_to_knuckle": (86.2, 78.0),
}
_DE_LEVA_STATURE_MM = (1741.0, 1735.0)


def segment_shape(segment: str, sex: Sex | None) -> SegmentShape:
    """A row of de Leva's table 4, its masses normalized so that the whole body weighs one."""
    row = _of_sex(np.array(_DE_LEVA[segment]) / 100, sex)
    paired = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
    total = sum(
        _of_sex(np.array(rows)[:, 0] / 100, sex) * (2 if name in paired else 1)
        for name, rows in _DE_LEVA.items()
    )
    return SegmentShape(float(row[0] / total), *(float(value) for value in row[1:]))


@dataclass(frozen=True)
class Lengths:
    """Lengths of one person [m]."""

    stature: float
    thigh: float
    shank: float
    ankle_height: float
    foot: float
    foot_breadth: float
    shoulder_half_width: float  # of the shoulder centres
    upper_arm: float
    forearm: float
    hand: float  # wrist to third knuckle
    pelvis_width: float  # between the anterior superior iliac spines
    pelvis_depth: float  # between the midpoints of anterior and posterior spines
    trunk_above_navel: tuple[float, float]  # navel to xiphoid, xiphoid to suprasternal notch
    navel_above_hips: float
    shoulders_above_hips: float
    c7_above_hips: float
    head: float  # C7 to vertex
    carrying_angle: float  # [rad]

    @property
    def hip_height(self) -> float:
        """Height of the hip centres above the sole in upright stance [m]."""
        return self.ankle_height + self.shank + self.thigh


def lengths(stature: float, sex: Sex | None) -> Lengths:
    """Segment lengths from stature.

    Legs: Drillis R, Contini R. Body segment parameters. New York University report 1166-03, 1966 (fractions
    as drawn in Winter, Biomechanics and Motor Control of Human Movement, fig. 4.1). Arms: de Leva's means
    over his mean stature. Trunk and head: his proportions, stretched by one factor so that legs, trunk and
    head add up to the stature. Shoulder centres: half the biacromial breadth of Gordon et al., 1988
    Anthropometric Survey of US Army Personnel (39.7 of 175.6 cm, 36.3 of 162.9 cm), less the humeral head's
    radius (24 mm; Iannotti et al., J Bone Joint Surg Am 1992; 74: 491-500). Pelvis: rounded means of adults
    of both sexes (24 cm wide and 15 cm deep at 1.74 m; Seidel et al., J Biomech 1995; 28: 995-998, report
    such sizes). Carrying angle of the elbow: Keats et al., Radiology 1966; 87: 904-907 (men 11°, women 13°).
    """
    thigh, shank, ankle = 0.245, 0.246, 0.039
    mm = {name: float(_of_sex(np.array(pair), sex)) for name, pair in _DE_LEVA_LENGTHS_MM.items()}
    trunk = stature * (1 - thigh - shank - ankle) / (mm["vertex_to_c7"] + mm["c7_to_hips"])
    arm = stature / float(_of_sex(np.array(_DE_LEVA_STATURE_MM), sex))
    biacromial = float(_of_sex(np.array([39.7 / 175.6, 36.3 / 162.9]), sex))
    return Lengths(
        stature=stature,
        thigh=thigh * stature,
        shank=shank * stature,
        ankle_height=ankle * stature,
        foot=0.152 * stature,
        foot_breadth=0.055 * stature,
        shoulder_half_width=(biacromial / 2 - 0.024 / 1.75) * stature,
        upper_arm=arm * mm["shoulder_to_elbow"],
        forearm=arm * mm["elbow_to_wrist"],
        hand=arm * mm["wrist_to_knuckle"],
        pelvis_width=0.138 * stature,
        pelvis_depth=0.086 * stature,
        trunk_above_navel=(trunk * mm["xiphoid_to_navel"], trunk * mm["sternum_to_xiphoid"]),
        navel_above_hips=trunk * mm["navel_to_hips"],
        shoulders_above_hips=trunk * mm["shoulders_to_hips"],
        c7_above_hips=trunk * mm["c7_to_hips"],
        head=trunk * mm["vertex_to_c7"],
        carrying_angle=float(np.radians(_of_sex(np.array([11.0, 13.0]), sex))),
    )


def hip_centre(of: Lengths) -> np.ndarray:
    """Right hip centre in the pelvis frame [m]: origin between the anterior spines, y up, z to the right.

    Harrington ME et al. Prediction of the hip joint centre. J Biomech 2007; 40: 595-602, whose frame lies in
    the plane of the four spines; in upright stance that plane falls forward by 11° (Levine D, Whittle MW. J
    Orthop Sports Phys Ther 1996; 24: 130-135).
    """
    in_spine_plane = np.array(
        [-0.24 * of.pelvis_depth - 0.0099, -0.30 * of.pelvis_width - 0.0109, 0.33 * of.pelvis_width + 0.0073]
    )
    c, s = np.cos(PELVIC_INCLINATION), np.sin(PELVIC_INCLINATION)
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ in_spine_plane


PELVIC_INCLINATION = float(np.radians(11.0))

# Mantovani G, Ng KCG, Lamontagne M. Gait Posture 2016; 44: 48-54: on tomographs of 67 adults the skin lies
# 9.7 mm (standard deviation 7.0) before the anterior and 19.6 mm (10.9) behind the posterior superior iliac
# spines.
ASIS_SKIN = 0.0097 / 1.74  # of stature
PSIS_SKIN = 0.0196 / 1.74

# Isman RE, Inman VT. Anthropometric studies of the human foot and ankle. Bull Prosthet Res 1969; 10-11:
# 97-129: the ankle's axis makes 80° with the shank's line (its lateral end is the lower) and 84° with the
# foot's midline (its lateral end lies behind); the subtalar axis rises 41° and points 23° to the medial side
# of the midline; the metatarsal break makes 62° with the foot's long axis. Positive: dorsiflexion, inversion,
# toe extension.
ANKLE_AXIS = np.array([-np.tan(np.radians(6)), -np.tan(np.radians(10)), 1.0])
SUBTALAR_AXIS = np.array(
    [np.cos(np.radians(41)) * np.cos(np.radians(23)), np.sin(np.radians(41)),
     -np.cos(np.radians(41)) * np.sin(np.radians(23))]
)  # fmt: skip
METATARSAL_BREAK_AXIS = np.array([-np.cos(np.radians(62)), 0.0, np.sin(np.radians(62))])

# Foot: the ankle stands over 24 % of its length; the ball lies at 72.5 % (Gordon et al. 1988: 19.5 of 26.9
# cm).
ANKLE_ALONG_FOOT = 0.24
BALL_ALONG_FOOT = 0.725

# Iwaki H, Pinskerova V, Freeman MAR. J Bone Joint Surg Br 2000; 82: 1189-1195, and Johal P et al. J Biomech
# 2005; 38: 269-276: from extension to 120° the medial condyle's flexion centre stays within some 3 mm while
# the lateral one rolls back about 17 mm, so their midpoint rolls back 10 mm, in a person of 1.75 m.
KNEE_ROLL_BACK_AT_120_DEG = 0.010 / 1.75  # of stature
# Amis AA, Senavongse W, Bull AMJ. J Orthop Res 2006; 24: 2201-2211: the patella flexes 0.7° a degree of the
# knee.
PATELLA_FLEXION_RATIO = 0.7

# Greene WB, Heckman JD. The Clinical Measurement of Joint Motion. AAOS 1994, rounded outwards to leave room
# for errors of axes and markers [deg]; pronation counts from full supination.
RANGES_DEG: dict[str, tuple[float, float]] = {
    "hip_flexion": (-40, 130), "hip_adduction": (-55, 40), "hip_rotation": (-50, 50),
    "knee_angle": (-10, 150), "ankle_angle": (-60, 40), "subtalar_angle": (-30, 40), "mtp_angle": (-45, 80),
    "lumbar_extension": (-90, 40), "lumbar_bending": (-45, 45), "lumbar_rotation": (-50, 50),
    "arm_flex": (-80, 180), "arm_add": (-180, 60), "arm_rot": (-100, 100), "elbow_flex": (-10, 155),
    "pro_sup": (-10, 175), "wrist_flex": (-80, 90), "wrist_dev": (-30, 40),
}  # fmt: skip


def _of_sex(men_women: np.ndarray, sex: Sex | None) -> np.ndarray:
    if sex is None:
        return men_women.mean(axis=0)
    return men_women[0 if sex == "male" else 1]
