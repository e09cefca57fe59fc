"""A file whose writer was killed gives back every complete chunk."""

from collections import Counter

import numpy as np
import pytest
from mcap.reader import make_reader

from addb_viewer.recordings.mcap_file import McapFile
from addb_viewer.recordings.mcap_recording import write_mcap
from addb_viewer.recordings.mcap_recovery import Found, readable, recover
from addb_viewer.recordings.mcap_schemas import PROGRESS
from addb_viewer.trial_view.recording import recording_of
from solver.common.errors import ResultsError


@pytest.fixture
def whole(make_fit, tmp_path):
    """A file of a dozen chunks and a few attachments."""
    return write_mcap(recording_of(make_fit(*(f"walk {i}" for i in range(8)))), tmp_path / "whole.mcap")


def contents(file):
    """Messages and attachments by an ordinary reader, which needs a whole file."""
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        messages = Counter((c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages())
        return messages, {a.name: a.data for a in reader.iter_attachments()}, reader.get_summary()


def test_a_file_cut_at_twenty_places_gives_back_all_complete_chunks(whole, tmp_path):
    messages, attachments, summary = contents(whole)
    data = whole.read_bytes()
    with whole.open("rb") as stream:
        by_chunk = messages_by_chunk(stream, summary)
    assert len(by_chunk) > 10
    first = min(c.chunk_start_offset + c.chunk_length for c in summary.chunk_indexes)
    cuts = np.random.default_rng(6).integers(first, len(data), 20)
    for cut in cuts.tolist():
        (tmp_path / "cut.mcap").write_bytes(data[:cut])
        found = recover(tmp_path / "cut.mcap", tmp_path / "recovered.mcap")
        ends = {c.chunk_start_offset: c.chunk_start_offset + c.chunk_length for c in summary.chunk_indexes}
        expected = Counter()
        for offset, its_messages in by_chunk.items():
            if ends[offset] <= cut:
                expected += its_messages
        got, got_attachments, _ = contents(tmp_path / "recovered.mcap")
        assert got == expected
        assert not found.is_whole
        kept = {a.name for a in summary.attachment_indexes if a.offset + a.length <= cut}
        assert got_attachments == {name: attachments[name] for name in kept}
    assert messages.total() == sum(c.total() for c in by_chunk.values())


def messages_by_chunk(stream, summary):
    from mcap.records import Channel, Message
    from mcap.stream_reader import StreamReader, breakup_chunk

    topics, by_chunk = {}, {}
    for index in summary.chunk_indexes:
        stream.seek(index.chunk_start_offset)
        chunk = next(iter(StreamReader(stream, skip_magic=True, emit_chunks=True).records))
        found = Counter()
        for part in breakup_chunk(chunk):
            if isinstance(part, Channel):
                topics[part.id] = part.topic
            elif isinstance(part, Message):
                found[(topics[part.channel_id], part.log_time, part.data)] += 1
        by_chunk[index.chunk_start_offset] = found
    return by_chunk


def test_a_whole_file_is_copied_whole(whole, tmp_path):
    found = recover(whole, tmp_path / "copy.mcap")
    assert found.is_whole
    assert contents(tmp_path / "copy.mcap")[:2] == contents(whole)[:2]
    assert found.messages.total() == contents(whole)[0].total()


def test_a_length_that_makes_no_sense_ends_the_file(whole, tmp_path):
    index = contents(whole)[2].chunk_indexes[3]
    data = bytearray(whole.read_bytes())
    data[index.chunk_start_offset + 1 : index.chunk_start_offset + 9] = b"\xff" * 8
    (tmp_path / "bad.mcap").write_bytes(data)
    found = recover(tmp_path / "bad.mcap", tmp_path / "recovered.mcap")
    assert found.chunks == 3
    assert not found.is_whole


def test_a_damaged_chunk_is_left_out_and_counted(whole, tmp_path):
    index = contents(whole)[2].chunk_indexes[2]
    data = bytearray(whole.read_bytes())
    middle = index.chunk_start_offset + index.chunk_length // 2
    data[middle : middle + 40] = bytes(40)
    (tmp_path / "bad.mcap").write_bytes(data)
    found = recover(tmp_path / "bad.mcap", tmp_path / "recovered.mcap")
    assert found.damaged_chunks == 1
    assert found.chunks == len(contents(whole)[2].chunk_indexes) - 1


@pytest.mark.parametrize("content", [b"", b"no MCAP file, but long enough", b"\x89MCAP0\r\n"])
def test_what_is_no_mcap_file_is_refused_and_nothing_is_written(content, tmp_path):
    (tmp_path / "bad.mcap").write_bytes(content)
    with pytest.raises(ResultsError, match=r"bad\.mcap"):
        recover(tmp_path / "bad.mcap", tmp_path / "recovered.mcap")
    assert not (tmp_path / "recovered.mcap").exists()


def test_what_was_flushed_is_there_before_the_file_is_finished(tmp_path):
    with (tmp_path / "open.mcap").open("wb") as stream:
        file = McapFile(stream)
        file.record("/solver/progress", 5, PROGRESS, {"stage": "ä"})
        file.flush()
        file.record("/solver/progress", 6, PROGRESS, {"stage": "b"})
        found = Found()
        told = [part.message.data.decode() for part in readable(tmp_path / "open.mcap", found)]
    assert told == ['{"stage": "ä"}']
    assert found.last_time_ns == 5
