"""What is left of an MCAP file whose writer was killed or whose disk was full: all of its whole chunks."""

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import zstandard
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Chunk, Footer, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer

from addb_viewer.recordings.mcap_file import CHUNK_BYTES
from solver.capture.atomic import whole_file
from solver.common.errors import ResultsError

# What the reader raises on a cut or damaged file: OverflowError where a length is nonsense.
_UNREADABLE = (McapError, OverflowError, ValueError, struct.error, MemoryError, zstandard.ZstdError)


@dataclass
class Found:
    """What could be read."""

    chunks: int = 0
    damaged_chunks: int = 0
    attachments: int = 0
    messages: Counter[str] = field(default_factory=Counter)  # by topic
    last_time_ns: int = 0  # of the latest message [ns]
    is_whole: bool = False  # the file ends as it should


@dataclass(frozen=True)
class Readable:
    """One thing in a file: a message with its channel and schema, an attachment, or metadata."""

    message: Message | None = None
    channel: Channel | None = None
    schema: Schema | None = None
    attachment: Attachment | None = None
    metadata: Metadata | None = None


def readable(file: Path, found: Found) -> Iterator[Readable]:
    """Everything that can be read, in the file's order; ends quietly where the file was cut.

    Args:
        file: an MCAP file, whole or not.
        found: counts what is read.

    Raises:
        ResultsError: not an MCAP file, or it cannot be opened.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    for record in _records(file, found):
        for part in _parts(record, found):
            match part:
                case Schema():
                    schemas[part.id] = part
                case Channel():
                    channels[part.id] = part
                case Message() if part.channel_id in channels:
                    channel = channels[part.channel_id]
                    found.messages[channel.topic] += 1
                    found.last_time_ns = max(found.last_time_ns, part.log_time)
                    yield Readable(message=part, channel=channel, schema=schemas.get(channel.schema_id))
                case Attachment():
                    found.attachments += 1
                    yield Readable(attachment=part)
                case Metadata():
                    yield Readable(metadata=part)


def recover(file: Path, out: Path) -> Found:
    """Write a whole file with everything that can be read of another one, which stays as it is.

    Args:
        file: an MCAP file that may be cut.
        out: made, or replaced; its folder must exist.

    Raises:
        ResultsError: not an MCAP file, or nothing of it can be read.
        CaptureError: `out` cannot be written.
    """
    found = Found()
    with whole_file(out) as stream:
        writer = Writer(stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        writer.start(library="addb-viewer recover")
        copier = _Copier(writer)
        for part in readable(file, found):
            copier.copy(part)
        if not found.messages and not found.attachments:
            raise ResultsError(f"{file}: nothing in it can be read")
        writer.finish()
    return found


class _Copier:
    """Writes what was read, with numbers of its own for schemas and channels."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def copy(self, part: Readable) -> None:
        if part.message is not None and part.channel is not None:
            m, channel = part.message, self._channel(part.channel, part.schema)
            self._writer.add_message(channel, m.log_time, m.data, m.publish_time, m.sequence)
        elif part.attachment is not None:
            a = part.attachment
            self._writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
        elif part.metadata is not None:
            self._writer.add_metadata(part.metadata.name, part.metadata.metadata)

    def _channel(self, channel: Channel, schema: Schema | None) -> int:
        if channel.topic not in self._channels:
            number = 0 if schema is None else self._schema(schema)
            self._channels[channel.topic] = self._writer.register_channel(
                channel.topic, channel.message_encoding, number, channel.metadata
            )
        return self._channels[channel.topic]

    def _schema(self, schema: Schema) -> int:
        if schema.name not in self._schemas:
            number = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            self._schemas[schema.name] = number
        return self._schemas[schema.name]


def _records(file: Path, found: Found) -> Iterator[McapRecord]:
    """Records outside chunks, and chunks as they are."""
    try:
        stream = file.open("rb")
    except OSError as error:
        raise ResultsError(f"{file}: cannot be opened ({error.strerror})") from error
    with stream:
        reader = StreamReader(stream, emit_chunks=True, record_size_limit=max(file.stat().st_size, 1))
        records, began, ended = reader.records, False, False
        while True:
            try:
                record = next(records, None)
            except _UNREADABLE as error:
                if not began:
                    raise ResultsError(f"{file}: not an MCAP file, or cut at its very beginning") from error
                return
            if record is None:
                found.is_whole = ended
                return
            began = began or isinstance(record, Header)
            ended = ended or isinstance(record, Footer)
            yield record


def _parts(record: McapRecord, found: Found) -> list[McapRecord]:
    """What a chunk holds; anything else is its own part."""
    if not isinstance(record, Chunk):
        return [record]
    try:
        parts = breakup_chunk(record, validate_crc=True)
    except _UNREADABLE:
        found.damaged_chunks += 1
        return []
    found.chunks += 1
    return parts
