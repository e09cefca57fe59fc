"""What a table of a release is: columns with types, units and meanings, as Arrow and as JSON have them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import pyarrow as pa

Kind = Literal["bool", "i8", "i16", "i32", "i64", "u8", "f32", "f64", "text", "texts", "floats"]

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
    kind: Kind
    description: str
    unit: str = ""
    frame: str = ""  # of reference, in which a vector's components are
    shape: str = "scalar"  # of the quantity that it is a part of
    source: str = ""  # where its values come from
    nullable: bool = False
    family: str = ""  # how the page of documentation writes it together with its like; empty: alone

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
            kind = column.kind + ("?" if column.nullable else "")
            where = f" ({column.frame})" if column.frame else ""
            lines.append(f"| `{name}` | {kind} | {column.unit} | {column.description}{where} |")
        return "\n".join(lines)


def vector(
    pattern: str,
    unit: str,
    description: str,
    *,
    frame: str = "ground",
    source: str = "",
    nullable: bool = False,
    axes: Sequence[str] = ("x", "y", "z"),
) -> tuple[Column, ...]:
    """A column for each component.

    Args:
        pattern: of the columns' names; `{}` is the axis.
        unit: of each component.
        description: of the vector.
        frame: of reference.
        source: of the values.
        nullable: whether there can be none.
        axes: names of the components.
    """
    family = pattern.format("{" + ",".join(axes) + "}")
    shape = f"{len(axes)} ({', '.join(axes)})"
    return tuple(
        Column(pattern.format(axis), "f32", description, unit, frame, shape, source, nullable, family)
        for axis in axes
    )


def _arrow_type(kind: Kind) -> "pa.DataType":
    pa = _arrow()
    if kind in ("texts", "floats"):
        item = pa.string() if kind == "texts" else pa.float32()
        return pa.list_(pa.field("element", item, nullable=False))
    return pa.type_for_alias(ARROW_TYPES[kind])


def _arrow() -> Any:
    import pyarrow  # noqa: PLC0415 (a quarter of a second; the command line asks for names alone)

    return pyarrow
