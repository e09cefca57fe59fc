"""What a .b3d file holds. Names and numbers of the fields are the format's own."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import Any, TypeVar

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import Message
from jaxtyping import Bool, Float, Int, UInt8

VERSION = 4  # of the format, as its other writers state it at present
PACKAGE = "b3d"
UNKNOWN = "unknown"  # the dataclass field that keeps what a newer version of the format added
_FIELD = descriptor_pb2.FieldDescriptorProto
_TYPES = {
    "int32": (_FIELD.TYPE_INT32, np.int32, 0),
    "enum": (_FIELD.TYPE_INT32, np.int32, 0),  # the same bytes; values that we have no name for survive
    "float": (_FIELD.TYPE_FLOAT, np.float32, 0.0),
    "double": (_FIELD.TYPE_DOUBLE, np.float64, 0.0),
    "bool": (_FIELD.TYPE_BOOL, np.bool_, False),
    "string": (_FIELD.TYPE_STRING, None, ""),
}
_CLASSES: dict[type, type[Message]] = {}
T = TypeVar("T")
REASONS = (
    "notMissingGRF",
    "measuredGrfZeroWhenAccelerationNonZero",
    "unmeasuredExternalForceDetected",
    "torqueDiscrepancy",
    "forceDiscrepancy",
    "notOverForcePlate",
    "missingImpact",
    "missingBlip",
    "shiftGRF",
    "interpolatedClippedGRF",
    "manualReview",
    "footContactDetectedButNoForce",
    "tooHighMarkerRMS",
    "hasInputOutliers",
    "hasNoForcePlateData",
    "velocitiesStillTooHighAfterFiltering",
    "copOutsideConvexFootError",
    "zeroForceFrame",
    "extendedToNearestPeakForce",
)  # a reason's place is its number
REVIEWED = "manualReview"  # a person decided; no other word is said


@dataclass(frozen=True)
class _Wire:
    number: int
    kind: str | type  # a protobuf type, or the dataclass of a nested message
    repeated: bool


def one(number: int, kind: str) -> Any:
    """A dataclass field that is a single value on the wire; missing there, it has proto3's default."""
    return field(default=_TYPES[kind][2], metadata={PACKAGE: _Wire(number, kind, repeated=False)})


def many(number: int, kind: str | type) -> Any:
    """A dataclass field that is repeated on the wire: an array of numbers, a tuple of texts or messages."""
    metadata = {PACKAGE: _Wire(number, kind, repeated=True)}
    dtype = _TYPES[kind][1] if isinstance(kind, str) else None
    if dtype is None:
        return field(default=(), metadata=metadata)
    return field(default_factory=lambda: np.zeros(0, dtype), metadata=metadata)


def encode_message(value: Any) -> bytes:
    """A dataclass of `one` and `many` fields as protobuf writes it: fields in the order of their numbers.

    Raises:
        TypeError, ValueError: a value is not of its field's type, or out of its range.
    """
    message = _message_class(type(value))()
    _fill(message, value)
    return message.SerializeToString(deterministic=True)


def decode_message(cls: type[T], data: bytes) -> T:
    """The dataclass that a message holds; fields that it doesn't know are kept in `unknown`.

    Raises:
        google.protobuf.message.DecodeError: the bytes are no such message.
    """
    message = _message_class(cls)()
    message.ParseFromString(data)
    return _value(cls, message)


def _fill(message: Message, value: Any) -> None:
    message.MergeFromString(value.unknown)
    for name, wire in _wires(type(value)).items():
        content = getattr(value, name)
        if not wire.repeated:
            setattr(message, name, content)
        elif isinstance(wire.kind, type):
            for item in content:
                _fill(getattr(message, name).add(), item)
        else:
            getattr(message, name).extend(content.tolist() if isinstance(content, np.ndarray) else content)


def _value(cls: type[T], message: Message) -> T:
    members: dict[str, Any] = {}
    for name, wire in _wires(cls).items():
        content = getattr(message, name)
        if not wire.repeated:
            members[name] = content
        elif isinstance(wire.kind, type):
            members[name] = tuple(_value(wire.kind, item) for item in content)
        else:
            dtype = _TYPES[wire.kind][1]
            members[name] = tuple(content) if dtype is None else np.array(content, dtype)
        message.ClearField(name)
    return cls(**members, **{UNKNOWN: message.SerializeToString()})


def _wires(cls: type) -> dict[str, _Wire]:
    return {f.name: f.metadata[PACKAGE] for f in fields(cls) if PACKAGE in f.metadata}


def _message_class(cls: type) -> type[Message]:
    """Made once: each pool has classes of its own."""
    if cls not in _CLASSES:
        _CLASSES[cls] = _described_class(cls)
    return _CLASSES[cls]


def _described_class(cls: type) -> type[Message]:
    file = descriptor_pb2.FileDescriptorProto(name=f"{cls.__name__}.proto", package=PACKAGE, syntax="proto3")
    for message in dict.fromkeys(_with_nested(cls)):
        _describe(file.message_type.add(name=message.__name__), message)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(file.SerializeToString())
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{cls.__name__}"))


def _with_nested(cls: type) -> Sequence[type]:
    nested = [wire.kind for wire in _wires(cls).values() if isinstance(wire.kind, type)]
    return [cls, *(inner for kind in nested for inner in _with_nested(kind))]


def _describe(descriptor: descriptor_pb2.DescriptorProto, cls: type) -> None:
    for name, wire in _wires(cls).items():
        label = _FIELD.LABEL_REPEATED if wire.repeated else _FIELD.LABEL_OPTIONAL
        described = descriptor.field.add(name=name, number=wire.number, label=label)
        if isinstance(wire.kind, type):
            described.type = _FIELD.TYPE_MESSAGE
            described.type_name = f".{PACKAGE}.{wire.kind.__name__}"
        else:
            described.type = _TYPES[wire.kind][0]


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
