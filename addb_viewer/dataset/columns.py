"""Columns of a release: types, units, meanings; and those that have one value a frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow as pa

ARROW_TYPES = {
    "bool": "bool",
    "i8": "int8",
    "i16": "int16",
    "i32": "int32",
    "i64": "int64",
    "u8": "uint8",
    "f32": "float",
    "f64": "double",
    "text": "string",
    "texts": "list<text>",
    "floats": "list<f32>",
}
METADATA = b"addb"  # key of a file's own metadata


@dataclass(frozen=True)
class Column:
    """One column. `description` says what a null means where there can be one."""

    name: str
    type: str  # a kind of `ARROW_TYPES`; behind it a question mark where there can be a null
    description: str
    unit: str = ""
    frame: str = ""  # of reference, in which a vector's components are
    shape: str = "scalar"  # of the quantity that it is a part of
    source: str = ""  # where its values come from
    family: str = ""  # how the page of documentation writes it together with its like; empty: alone

    @property
    def kind(self) -> str:
        """What its values are, null or not."""
        return self.type.removesuffix("?")

    @property
    def nullable(self) -> bool:
        """Whether there can be a null."""
        return self.type.endswith("?")

    @property
    def metadata(self) -> dict[str, str]:
        """What readers find beside the column in every file; keys without a word are left out."""
        keys = ("unit", "frame", "shape", "description", "source")
        return {key: getattr(self, key) for key in keys if getattr(self, key)}

    def field(self) -> "pa.Field":
        """The column as an Arrow field."""
        return _arrow().field(self.name, _arrow_type(self.kind), self.nullable, self.metadata)


@dataclass(frozen=True)
class Table:
    """One table: a file for the whole release, or one for each subject."""

    name: str
    path: str  # in the release; `{subject}` is the subject's id as file names bear it
    description: str
    columns: tuple[Column, ...]
    key: tuple[str, ...]  # columns that tell a row from all others
    order: tuple[str, ...]  # columns that rows are sorted by

    @property
    def of_subjects(self) -> bool:
        """Whether each subject has a file of its own."""
        return "{subject}" in self.path

    def file(self, subject: str = "") -> str:
        """Path of the file in the release.

        Args:
            subject: id as file names bear it, for tables that have a file a subject.
        """
        return self.path.format(subject=subject, name="*")

    def schema(self) -> "pa.Schema":
        """Types, nullability, and all metadata, of the table's files."""
        about = {METADATA: self.description.encode(), b"table": self.name.encode()}
        return _arrow().schema([column.field() for column in self.columns], metadata=about)

    def as_json(self) -> dict[str, Any]:
        """The table as schema.json has it."""
        columns = [
            {"name": column.name, "type": column.kind, "nullable": column.nullable, **column.metadata}
            for column in self.columns
        ]
        return {
            "path": self.path,
            "description": self.description,
            "key": list(self.key),
            "sorted_by": list(self.order),
            "columns": columns,
        }

    def as_markdown(self) -> str:
        """The table's rows on the page of documentation: a line a column, or a family of like columns."""
        lines = ["| column | type | unit | meaning |", "|---|---|---|---|"]
        families: dict[str, Column] = {}
        for column in self.columns:
            families.setdefault(column.family or column.name, column)
        for name, column in families.items():
            where = f" ({column.frame})" if column.frame else ""
            lines.append(f"| `{name}` | {column.type} | {column.unit} | {column.description}{where} |")
        return "\n".join(lines)


def vector(
    pattern: str,
    type: str,
    description: str,
    unit: str,
    *,
    frame: str = "ground",
    source: str = "",
    axes: Sequence[str] = ("x", "y", "z"),
) -> tuple[Column, ...]:
    """A column for each component.

    Args:
        pattern: of the columns' names; `{}` is the axis.
        type: of each component, as of `Column`.
        description: of the vector.
        unit: of each component.
        frame: of reference.
        source: of the values.
        axes: names of the components.
    """
    family = pattern.format("{" + ",".join(axes) + "}")
    shape = f"{len(axes)} ({', '.join(axes)})"
    return tuple(
        Column(pattern.format(axis), type, description, unit, frame, shape, source, family) for axis in axes
    )


def _arrow_type(kind: str) -> "pa.DataType":
    pa = _arrow()
    if kind in ("texts", "floats"):
        item = pa.string() if kind == "texts" else pa.float32()
        return pa.list_(pa.field("element", item, nullable=False))
    return pa.type_for_alias(ARROW_TYPES[kind])


def _arrow() -> Any:
    import pyarrow  # noqa: PLC0415 (a quarter of a second; the command line asks for names alone)

    return pyarrow


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
    Column("marker_rms_m", "f32?", "distance of markers from the skeleton, RMS", "m", source="fit"),
    Column("marker_max_m", "f32?", "the largest of these distances", "m", source="fit"),
    Column("linear_rms_bw", "f32?", "residual force over `used` frames, RMS", "body weight", source="fit"),
    Column(
        "angular_rms_bwh",
        "f32?",
        "residual moment over `used` frames, RMS",
        "body weight * height",
        source="fit",
    ),
)


def _coordinates(
    prefix: str, description: str, units: tuple[str, str], source: str = "fit"
) -> tuple[Column, ...]:
    """A column a coordinate; units are those of angles and of translations."""
    return tuple(
        Column(
            f"{prefix}_{name}",
            "f32?",
            f"{description}; null where the model lacks the coordinate",
            units[name in TRANSLATIONS],
            shape=f"{len(COORDINATE_NAMES)} (coordinates)",
            source=source,
            family=f"{prefix}_COORDINATE",
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
        *vector(f"grf_{side}_{{}}_N", "f32?", f"force on {foot}{null}", "N", source="plates"),
        *vector(
            f"grm_{side}_{{}}_Nm",
            "f32?",
            f"moment on {foot} about the origin of its body{null}",
            "N*m",
            source="plates",
        ),
        *vector(f"foot_{side}_{{}}_m", "f32", f"origin of {foot}'s body", "m", source="fit"),
        *vector(
            f"cop_{side}_{{}}_m",
            "f32?",
            f"centre of pressure of {foot}; null where its force does not count or is below 20 N",
            "m",
            source="plates",
        ),
        Column(
            f"free_moment_{side}_Nm",
            "f32?",
            f"moment on {foot} about the surface's normal at the centre of pressure; null likewise",
            "N*m",
            "surface normal",
            source="plates",
        ),
    )


_LABELS = (
    Column(
        "pass", "text", "D: fitted to the forces; F: low-passed, where no such fit was made", source="fit"
    ),
    Column("activity", "text", "class of what the person does; `none` where nobody and no rule says"),
    Column("activity_sub", "text?", "subclass; null where none was given"),
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
    Column("torque_predicted", "bool", "the torques rest on a foot's wrench that the motion requires"),
    Column("missing_reason", "text?", "why it does not count; null where it does"),
    Column("missing_number", "u8", "likewise, number of the B3D format; 0 where it counts"),
    Column(
        "phase",
        "i8?",
        "0 flight, 1 right foot alone, 2 left foot alone, 3 both; null where the frame does not count",
        source="plates",
    ),
    Column("contact_r", "bool", "the right foot is on the ground, measured or not", source="fit and plates"),
    Column("contact_l", "bool", "the left foot is on the ground, measured or not", source="fit and plates"),
)

_MOTION = (
    *_coordinates("q", "value", ("rad", "m")),
    *_coordinates("qd", "velocity", ("rad/s", "m/s")),
    *_coordinates("qdd", "acceleration", ("rad/s^2", "m/s^2")),
    *_coordinates(
        "tau",
        "generalized force M q̈ + C + g − Jᵀ f; those of pelvis_… are the residual about its own axes, no "
        "joint torque",
        ("N*m", "N"),
        "inverse dynamics",
    ),
    _others("q", "values of the model's further coordinates", "rad or m"),
    _others("qd", "their velocities", "rad/s or m/s"),
    _others("qdd", "their accelerations", "rad/s^2 or m/s^2"),
    _others("tau", "their generalized forces", "N*m or N"),
)

_BODY = (
    *vector("com_{}_m", "f32", "centre of mass of the body", "m", source="fit"),
    *vector("com_v_{}_m_s", "f32", "its velocity", "m/s", source="fit"),
    *vector("com_a_{}_m_s2", "f32", "its acceleration; gravity is not taken off", "m/s^2", source="fit"),
    *vector("pelvis_{}_m", "f32", "origin of the root body", "m", source="fit"),
    *vector(
        "pelvis_q{}",
        "f32",
        "orientation of the root body: unit quaternion",
        "1",
        source="fit",
        axes=("w", "x", "y", "z"),
    ),
)

_RESIDUALS = (
    *vector(
        "residual_force_{}_N",
        "f32?",
        "external force that the motion requires beyond the measured; null unless the frame counts",
        "N",
        source="inverse dynamics",
    ),
    *vector(
        "residual_moment_{}_Nm",
        "f32?",
        "likewise the moment, about the root joint's centre",
        "N*m",
        source="inverse dynamics",
    ),
    *vector(
        "residual_raw_force_{}_N",
        "f32?",
        "residual force against unfiltered plates",
        "N",
        source="inverse dynamics",
    ),
    *vector(
        "residual_raw_moment_{}_Nm",
        "f32?",
        "residual moment against unfiltered plates",
        "N*m",
        source="inverse dynamics",
    ),
    *vector(
        "extra_force_{}_N",
        "f32",
        "that accepted causes add to the balance; zero without one",
        "N",
        source="fit",
    ),
    *vector(
        "extra_moment_{}_Nm", "f32", "likewise the moment, about the root joint's centre", "N*m", source="fit"
    ),
    *vector("root_joint_{}_m", "f32", "the root joint's centre", "m", source="fit"),
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
    Column("marker_rms_m", "f32?", "distance of the frame's markers, RMS; null without any", "m"),
    Column("marker_max_m", "f32?", "the largest of these distances", "m"),
)

KINEMATICS_COLUMNS = (
    *FRAME_KEYS,
    *_coordinates("q", "value as the markers alone have it", ("rad", "m")),
    _others("q", "values of the model's further coordinates", "rad or m"),
)
