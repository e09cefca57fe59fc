"""Frozen dataclasses as protobuf messages: each field names its number and type, and that is the whole schema.

The messages are declared to the protobuf library at run time, in a pool of our own. So nothing has to be generated
by a compiler, and nothing generated has to fit the library's version.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any, TypeVar

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import Message

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

T = TypeVar("T")


@dataclass(frozen=True)
class _Wire:
    number: int
    kind: str | type  # a protobuf type, or the dataclass of a nested message
    repeated: bool


def one(number: int, kind: str) -> Any:
    """A dataclass field that is a single value on the wire; missing there, it has proto3's default."""
    return field(default=_TYPES[kind][2], metadata={PACKAGE: _Wire(number, kind, repeated=False)})


def many(number: int, kind: str | type) -> Any:
    """A dataclass field that is repeated on the wire: an array of numbers, or a tuple of texts or messages."""
    metadata = {PACKAGE: _Wire(number, kind, repeated=True)}
    dtype = _TYPES[kind][1] if isinstance(kind, str) else None
    if dtype is None:
        return field(default=(), metadata=metadata)
    return field(default_factory=lambda: np.zeros(0, dtype), metadata=metadata)


def encoded(value: Any) -> bytes:
    """A dataclass of `one` and `many` fields as protobuf writes it: fields in the order of their numbers.

    Raises:
        TypeError, ValueError: a value is not of its field's type, or out of its range.
    """
    message = _message_class(type(value))()
    _fill(message, value)
    return message.SerializeToString(deterministic=True)


def decoded(cls: type[T], data: bytes) -> T:
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


@cache
def _wires(cls: type) -> dict[str, _Wire]:
    return {f.name: f.metadata[PACKAGE] for f in fields(cls) if PACKAGE in f.metadata}


@cache
def _message_class(cls: type) -> type[Message]:
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
