"""An MCAP file being written: channels by topic, small chunks, attachments."""

import json
from collections.abc import Mapping
from typing import IO, Any

from google.protobuf.message import Message
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import build_file_descriptor_set

from addb_viewer.recordings.mcap_schemas import schema_text

CHUNK_BYTES = 64 * 1024  # before compression
PROFILE, LIBRARY = "", "addb-viewer"


class McapFile:
    """Takes messages in any order of their times."""

    def __init__(self, stream: IO[bytes]) -> None:
        """Begin a file.

        Args:
            stream: open for writing; stays open when the file is finished.
        """
        self._stream = stream
        self._writer = Writer(stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile=PROFILE, library=LIBRARY)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}

    def message(self, topic: str, time_ns: int, message: Message) -> None:
        """Write a message of a well-known schema."""
        if topic not in self._channels:
            self._open_binary(topic, type(message))
        self._write(topic, time_ns, message.SerializeToString())

    def record(self, topic: str, time_ns: int, title: str, content: Mapping[str, Any]) -> None:
        """Write a message as JSON.

        Args:
            topic: where to.
            time_ns: when [ns].
            title: of its schema.
            content: without NaN.
        """
        if topic not in self._channels:
            self._open_json(topic, title)
        self._write(topic, time_ns, json.dumps(content, allow_nan=False, ensure_ascii=False).encode())

    def attach(self, name: str, kind: str, content: str, time_ns: int) -> None:
        """Put a text file into the file.

        Args:
            name: of the text file.
            kind: media type.
            content: of it.
            time_ns: when it was made [ns].
        """
        self._writer.add_attachment(time_ns, time_ns, name, kind, content.encode())

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write names and values that belong to the whole file."""
        self._writer.add_metadata(name, dict(values))

    def finish(self) -> None:
        """Write the index; nothing can be added any more."""
        self._writer.finish()
        self._stream.flush()

    def _write(self, topic: str, time_ns: int, data: bytes) -> None:
        count = self._counts[topic] = self._counts.get(topic, -1) + 1
        self._writer.add_message(self._channels[topic], time_ns, data, time_ns, count)

    def _open_binary(self, topic: str, kind: type[Message]) -> None:
        name = kind.DESCRIPTOR.full_name
        if name not in self._schemas:
            described = build_file_descriptor_set(kind).SerializeToString()
            self._schemas[name] = self._writer.register_schema(name, SchemaEncoding.Protobuf, described)
        self._channels[topic] = self._writer.register_channel(
            topic, MessageEncoding.Protobuf, self._schemas[name]
        )

    def _open_json(self, topic: str, title: str) -> None:
        if title not in self._schemas:
            text = schema_text(title)
            self._schemas[title] = self._writer.register_schema(title, SchemaEncoding.JSONSchema, text)
        self._channels[topic] = self._writer.register_channel(
            topic, MessageEncoding.JSON, self._schemas[title]
        )
