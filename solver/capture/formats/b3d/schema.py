"""What a .b3d file holds. Names and numbers of the fields are the format's own."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from solver.capture.formats.b3d.wire import many, one

VERSION = 4  # of the format, as its other writers state it at present


class PassType(IntEnum):
    """What a processing pass did to the motion."""

    KINEMATICS = 0
    DYNAMICS = 1
    LOW_PASS_FILTER = 2
    ACCELERATION_MINIMIZING_FILTER = 3


class TrialType(IntEnum):
    """Where the person moved."""

    TREADMILL = 0
    OVERGROUND = 1
    STATIC = 2
    OTHER = 3


class DataQuality(IntEnum):
    """How a recording came about."""

    PILOT = 0
    EXPERIMENTAL = 1
    INTERNET = 2


@dataclass(frozen=True, eq=False)
class PassHeader:
    """One processing pass of one trial, frame by frame where it says so."""

    type: int = one(1, "enum")
    dof_positions_observed: Bool[np.ndarray, " dofs"] = many(2, "bool")  # a marker sees it
    dof_velocities_finite_differenced: Bool[np.ndarray, " dofs"] = many(3, "bool")  # not from a gyroscope
    dof_acceleration_finite_differenced: Bool[np.ndarray, " dofs"] = many(4, "bool")
    marker_rms: Float[np.ndarray, " frames"] = many(5, "float")  # [m]
    marker_max: Float[np.ndarray, " frames"] = many(6, "float")  # [m]
    linear_residual: Float[np.ndarray, " frames"] = many(7, "float")  # [N] of the root's translations
    angular_residual: Float[np.ndarray, " frames"] = many(8, "float")  # [N·m] about the root's Euler axes
    joints_max_velocity: Float[np.ndarray, " frames"] = many(9, "float")  # [rad/s or m/s] of all dofs
    lowpass_cutoff_frequency: float = one(10, "float")  # [Hz]
    lowpass_filter_order: int = one(11, "int32")
    force_plate_cutoff: Float[np.ndarray, " plates"] = many(12, "float")  # [N] smaller forces count as none
    acc_minimizing_regularization: float = one(13, "float")
    acc_minimizing_force_regularization: float = one(14, "float")
    unknown: bytes = b""  # fields of newer versions, as they stood


@dataclass(frozen=True, eq=False)
class TrialHeader:
    """One trial."""

    name: str = one(1, "string")
    missing_GRF_reason: Int[np.ndarray, " frames"] = many(2, "enum")  # numbers of `reasons.REASONS`
    trial_length: int = one(3, "int32")  # frames
    trial_timestep: float = one(4, "double")  # [s]
    processing_pass_header: tuple[PassHeader, ...] = many(5, PassHeader)
    trial_tag: tuple[str, ...] = many(6, "string")
    num_force_plates: int = one(7, "int32")
    force_plate_corners: Float[np.ndarray, " 12*plates"] = many(8, "double")  # [m] ground frame
    marker_names_guessed: bool = one(9, "bool")
    original_name: str = one(10, "string")  # before the trial was cut into pieces
    split_index: int = one(11, "int32")
    original_start_frame: int = one(12, "int32")
    original_end_frame: int = one(13, "int32")  # the first that no longer belongs
    original_start_time: float = one(14, "float")  # [s]
    original_end_time: float = one(15, "float")  # [s]
    has_manual_GRF_annotation: Bool[np.ndarray, " frames"] = many(16, "bool")
    trial_type: int = one(17, "enum")
    detected_trial_feature: Int[np.ndarray, " features"] = many(18, "enum")
    unknown: bytes = b""


@dataclass(frozen=True, eq=False)
class PassModel:
    """What a pass did, and the model that it did it with."""

    pass_type: int = one(1, "enum")
    model_osim_text: str = one(2, "string")
    unknown: bytes = b""


@dataclass(frozen=True, eq=False)
class Header:
    """Everything but the frames."""

    num_dofs: int = one(1, "int32")
    num_trials: int = one(2, "int32")  # 0 in most files: `trial_header` counts
    raw_sensor_frame_size: int = one(3, "int32")  # bytes
    processing_pass_frame_size: int = one(4, "int32")  # bytes
    passes: tuple[PassModel, ...] = many(5, PassModel)
    ground_contact_body: tuple[str, ...] = many(6, "string")
    custom_value_name: tuple[str, ...] = many(7, "string")
    custom_value_length: Int[np.ndarray, " names"] = many(8, "int32")
    trial_header: tuple[TrialHeader, ...] = many(9, TrialHeader)
    version: int = one(10, "int32")
    href: str = one(11, "string")
    notes: str = one(12, "string")
    biological_sex: str = one(13, "string")
    height_m: float = one(14, "double")
    mass_kg: float = one(15, "double")
    age_years: int = one(16, "int32")
    marker_name: tuple[str, ...] = many(17, "string")
    acc_name: tuple[str, ...] = many(18, "string")
    gyro_name: tuple[str, ...] = many(19, "string")
    emg_name: tuple[str, ...] = many(20, "string")
    emg_dim: int = one(21, "int32")  # samples of each signal a frame
    exo_dof_index: Int[np.ndarray, " exo"] = many(22, "int32")
    subject_tag: tuple[str, ...] = many(23, "string")
    num_joints: int = one(24, "int32")  # 0 in files from before it existed
    data_quality: int = one(25, "enum")
    unknown: bytes = b""


def _series(number: int) -> np.ndarray:
    """A series of doubles over a trial's frames; without columns where the file has no such field."""
    return field(default_factory=lambda: np.zeros((0, 0)), metadata={"number": number})


@dataclass(frozen=True, eq=False)
class SensorFrames:
    """What was measured in one trial, at its frames; NaN where nothing was."""

    custom_values: Float[np.ndarray, "frames n"] = _series(1)
    marker_obs: Float[np.ndarray, "frames 3*markers"] = _series(2)  # [m] ground frame
    acc_obs: Float[np.ndarray, "frames 3*sensors"] = _series(3)
    gyro_obs: Float[np.ndarray, "frames 3*sensors"] = _series(4)
    emg_obs: Float[np.ndarray, "frames signals*samples"] = _series(5)
    exo_obs: Float[np.ndarray, "frames exo"] = _series(6)
    raw_force_plate_cop: Float[np.ndarray, "frames 3*plates"] = _series(7)  # [m] ground frame
    raw_force_plate_torque: Float[np.ndarray, "frames 3*plates"] = _series(8)  # [N·m] about that point
    raw_force_plate_force: Float[np.ndarray, "frames 3*plates"] = _series(9)  # [N] on the person
    unknown: dict[int, UInt8[np.ndarray, "frames bytes"]] = field(default_factory=dict)  # payload by tag


@dataclass(frozen=True, eq=False)
class PassFrames:
    """One processing pass of one trial, at its frames; docs/reference/export.md says what each series means.

    A wrench is [moment, force]: about the ground origin, or in the root frame about the root body's origin.
    """

    pos: Float[np.ndarray, "frames dofs"] = _series(1)  # [rad or m]
    vel: Float[np.ndarray, "frames dofs"] = _series(2)
    acc: Float[np.ndarray, "frames dofs"] = _series(3)
    tau: Float[np.ndarray, "frames dofs"] = _series(4)  # [N·m or N] the root's are the residual
    ground_contact_wrench: Float[np.ndarray, "frames 6*bodies"] = _series(5)  # ground frame
    ground_contact_center_of_pressure: Float[np.ndarray, "frames 3*bodies"] = _series(6)  # [m]
    ground_contact_torque: Float[np.ndarray, "frames 3*bodies"] = _series(7)  # [N·m] about that point
    ground_contact_force: Float[np.ndarray, "frames 3*bodies"] = _series(8)  # [N]
    com_pos: Float[np.ndarray, "frames 3"] = _series(9)  # [m] ground frame
    com_vel: Float[np.ndarray, "frames 3"] = _series(10)  # [m/s]
    com_acc: Float[np.ndarray, "frames 3"] = _series(11)  # [m/s²] less gravity's
    root_frame_residual: Float[np.ndarray, "frames 6"] = _series(12)
    root_frame_ground_contact_wrench: Float[np.ndarray, "frames 6*bodies"] = _series(14)
    root_frame_joint_centers: Float[np.ndarray, "frames 3*joints"] = _series(15)  # [m]
    world_frame_joint_centers: Float[np.ndarray, "frames 3*joints"] = _series(16)  # [m]
    root_frame_com_acc: Float[np.ndarray, "frames 3"] = _series(17)  # [m/s²]
    root_frame_ground_contact_center_of_pressure: Float[np.ndarray, "frames 3*bodies"] = _series(18)
    root_frame_ground_contact_torques: Float[np.ndarray, "frames 3*bodies"] = _series(19)
    root_frame_ground_contact_force: Float[np.ndarray, "frames 3*bodies"] = _series(20)
    root_frame_spatial_velocity: Float[np.ndarray, "frames 6"] = _series(21)  # [angular, linear]
    root_frame_spatial_acceleration: Float[np.ndarray, "frames 6"] = _series(22)
    root_frame_root_pos_history: Float[np.ndarray, "frames 3*entries"] = _series(23)  # [m]
    root_frame_root_euler_history: Float[np.ndarray, "frames 3*entries"] = _series(24)  # [rad]
    unknown: dict[int, UInt8[np.ndarray, "frames bytes"]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class B3dTrial:
    """One trial: its header, its sensors, and one set of frames for each of the header's passes."""

    header: TrialHeader
    sensors: SensorFrames
    passes: tuple[PassFrames, ...]


@dataclass(frozen=True, eq=False)
class B3dFile:
    """A subject. From a file, `trials` opens each when it is asked for, and leaves its frames on the disk."""

    header: Header
    trials: Sequence[B3dTrial]
