"""Columns that have one value a frame: tables `frames` and `kinematics`, and figures made from them."""

from addb_viewer.dataset.table import Column, vector

COORDINATE_NAMES = (
    *("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz"),
    *("hip_flexion_r", "hip_adduction_r", "hip_rotation_r"),
    *("knee_angle_r", "ankle_angle_r", "subtalar_angle_r", "mtp_angle_r"),
    *("hip_flexion_l", "hip_adduction_l", "hip_rotation_l"),
    *("knee_angle_l", "ankle_angle_l", "subtalar_angle_l", "mtp_angle_l"),
    *("lumbar_extension", "lumbar_bending", "lumbar_rotation"),
    *("arm_flex_r", "arm_add_r", "arm_rot_r", "elbow_flex_r", "pro_sup_r", "wrist_flex_r", "wrist_dev_r"),
    *("arm_flex_l", "arm_add_l", "arm_rot_l", "elbow_flex_l", "pro_sup_l", "wrist_flex_l", "wrist_dev_l"),
)
"""Coordinates with columns of their own: those of the default body, OpenSim's names. Others go into lists."""

TRANSLATIONS = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
SIDES = ("r", "l")
SIDE_WORDS = {"r": "right", "l": "left"}

FRAME_KEYS = (
    Column("subject_id", "text", "SOURCE/FOLDER"),
    Column("trial_id", "text", "SOURCE/FOLDER/TRIAL"),
    Column("segment", "i16", "number of the segment in the trial, from 0"),
    Column("frame", "i32", "in the trial, from 0, on the release's grid"),
    Column("time_s", "f64", "on the recording's clock", "s"),
)

MEASURES = (
    Column(
        "marker_rms_m", "f32", "distance of markers from the skeleton, RMS", "m", source="fit", nullable=True
    ),
    Column("marker_max_m", "f32", "the largest of these distances", "m", source="fit", nullable=True),
    Column(
        "linear_rms_bw",
        "f32",
        "residual force over `used` frames, RMS",
        "body weight",
        source="fit",
        nullable=True,
    ),
    Column(
        "angular_rms_bwh",
        "f32",
        "residual moment over `used` frames, RMS",
        "body weight * height",
        source="fit",
        nullable=True,
    ),
)


def _coordinates(prefix: str, per: str, description: str) -> tuple[Column, ...]:
    """A column a coordinate; null where the model lacks it."""
    return tuple(
        Column(
            f"{prefix}_{name}",
            "f32",
            f"{description}; null where the model lacks the coordinate",
            f"{'m' if name in TRANSLATIONS else 'rad'}{per}",
            shape=f"{len(COORDINATE_NAMES)} (coordinates)",
            source="fit",
            nullable=True,
            family=f"{prefix}_COORDINATE",
        )
        for name in COORDINATE_NAMES
    )


def _torques() -> tuple[Column, ...]:
    return tuple(
        Column(
            f"tau_{name}",
            "f32",
            "generalized force M q̈ + C + g − Jᵀ f; those of pelvis_… are the residual about its own axes, no "
            "joint torque; null where the model lacks the coordinate",
            "N" if name in TRANSLATIONS else "N*m",
            shape=f"{len(COORDINATE_NAMES)} (coordinates)",
            source="inverse dynamics",
            nullable=True,
            family="tau_COORDINATE",
        )
        for name in COORDINATE_NAMES
    )


def _others(prefix: str, description: str, unit: str) -> Column:
    return Column(
        f"{prefix}_other", "floats", description, unit, shape="list (table coordinates)", source="fit"
    )


def _foot(side: str) -> tuple[Column, ...]:
    foot = f"the {SIDE_WORDS[side]} foot"
    null = "; null where it does not count"
    return (
        *vector(f"grf_{side}_{{}}_N", "N", f"force on {foot}{null}", source="plates", nullable=True),
        *vector(
            f"grm_{side}_{{}}_Nm",
            "N*m",
            f"moment on {foot} about the origin of its body{null}",
            source="plates",
            nullable=True,
        ),
        *vector(f"foot_{side}_{{}}_m", "m", f"origin of {foot}'s body", source="fit"),
        *vector(
            f"cop_{side}_{{}}_m",
            "m",
            f"centre of pressure of {foot}; null where its force does not count or is below 20 N",
            source="plates",
            nullable=True,
        ),
        Column(
            f"free_moment_{side}_Nm",
            "f32",
            f"moment on {foot} about the surface's normal at the centre of pressure; null likewise",
            "N*m",
            "surface normal",
            source="plates",
            nullable=True,
        ),
    )


_LABELS = (
    Column(
        "pass", "text", "D: fitted to the forces; F: low-passed, where no such fit was made", source="fit"
    ),
    Column("activity", "text", "class of what the person does; `none` where nobody and no rule says"),
    Column("activity_sub", "text", "subclass; null where none was given", nullable=True),
    Column("activity_by", "text", "person: confirmed; rule, rule (unlearnt): suggested; nobody"),
)

_COUNTS = (
    Column("counts", "bool", "every foot's force was measured and is right", source="review"),
    Column("counts_r", "bool", "the right foot's force counts", source="review"),
    Column("counts_l", "bool", "the left foot's force counts", source="review"),
    Column("detected_ok", "bool", "detection finds no fault by itself, whoever reviewed", source="detection"),
    Column(
        "reviewed",
        "bool",
        "a person or an imported review has decided about the frame, or a person has finished the trial",
        source="review",
    ),
    Column("used", "bool", "counts and is 10 native frames or more from the trial's ends: what figures use"),
    Column("torque_predicted", "bool", "the torques rest on a foot's wrench that the motion demands"),
    Column("missing_reason", "text", "why it does not count; null where it does", nullable=True),
    Column("missing_number", "u8", "likewise, number of the B3D format; 0 where it counts"),
    Column(
        "phase",
        "i8",
        "0 flight, 1 right foot alone, 2 left foot alone, 3 both; null where the frame does not count",
        source="plates",
        nullable=True,
    ),
    Column("contact_r", "bool", "the right foot is on the ground, measured or not", source="fit and plates"),
    Column("contact_l", "bool", "the left foot is on the ground, measured or not", source="fit and plates"),
)

_MOTION = (
    *_coordinates("q", "", "value"),
    *_coordinates("qd", "/s", "velocity"),
    *_coordinates("qdd", "/s^2", "acceleration"),
    *_torques(),
    _others("q", "values of the model's further coordinates", "rad or m"),
    _others("qd", "their velocities", "rad/s or m/s"),
    _others("qdd", "their accelerations", "rad/s^2 or m/s^2"),
    _others("tau", "their generalized forces", "N*m or N"),
)

_BODY = (
    *vector("com_{}_m", "m", "centre of mass of the body", source="fit"),
    *vector("com_v_{}_m_s", "m/s", "its velocity", source="fit"),
    *vector("com_a_{}_m_s2", "m/s^2", "its acceleration; gravity is not taken off", source="fit"),
    *vector("pelvis_{}_m", "m", "origin of the root body", source="fit"),
    *vector(
        "pelvis_q{}",
        "1",
        "orientation of the root body: unit quaternion",
        source="fit",
        axes=("w", "x", "y", "z"),
    ),
)

_RESIDUALS = (
    *vector(
        "residual_force_{}_N",
        "N",
        "external force that the motion demands beyond the measured; null unless the frame counts",
        source="inverse dynamics",
        nullable=True,
    ),
    *vector(
        "residual_moment_{}_Nm",
        "N*m",
        "likewise the moment, about the root joint's centre",
        source="inverse dynamics",
        nullable=True,
    ),
    *vector(
        "residual_raw_force_{}_N",
        "N",
        "residual force against unfiltered plates",
        source="inverse dynamics",
        nullable=True,
    ),
    *vector(
        "residual_raw_moment_{}_Nm",
        "N*m",
        "residual moment against unfiltered plates",
        source="inverse dynamics",
        nullable=True,
    ),
    *vector(
        "extra_force_{}_N", "N", "that accepted causes add to the balance; zero without one", source="fit"
    ),
    *vector("extra_moment_{}_Nm", "N*m", "likewise the moment, about the root joint's centre", source="fit"),
    *vector("root_joint_{}_m", "m", "the root joint's centre", source="fit"),
)

FRAME_COLUMNS = (
    *FRAME_KEYS,
    *_LABELS,
    *_COUNTS,
    *_MOTION,
    *_BODY,
    *_foot("r"),
    *_foot("l"),
    *_RESIDUALS,
    Column(
        "marker_rms_m", "f32", "distance of the frame's markers, RMS; null without any", "m", nullable=True
    ),
    Column("marker_max_m", "f32", "the largest of these distances", "m", nullable=True),
)

KINEMATICS_COLUMNS = (
    *FRAME_KEYS,
    *_coordinates("q", "", "value as the markers alone have it"),
    _others("q", "values of the model's further coordinates", "rad or m"),
)
