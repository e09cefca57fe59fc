"""Damaged, cut and foreign files: one clear line, and no memory or reading on their say-so."""

import os
import struct
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from solver.capture.formats.b3d.b3d_fields import encode_message
from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.common.errors import CaptureError


@pytest.fixture
def path(subject, tmp_path):
    write_b3d(subject, tmp_path / "subject.b3d")
    return tmp_path / "subject.b3d"


def open_all(path):
    return list(read_b3d(path).trials)


def test_trials_by_place_and_in_slices(path):
    trials = read_b3d(path).trials
    assert len(trials) == 2
    assert trials[-1].header.name == "trial 1"
    assert [trial.header.name for trial in trials[:1]] == ["trial 0"]
    with pytest.raises(IndexError):
        trials[2]


def test_wherever_a_file_is_cut_it_says_so(path):
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        with pytest.raises(CaptureError, match=r"subject\.b3d: (is cut off|no \.b3d file)"):
            read_b3d(path)


def test_bytes_behind_the_last_frame(path):
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(CaptureError, match="does not end where it should"):
        read_b3d(path)


@pytest.mark.parametrize("length", [2**60, 2**63 - 1, -1, -(2**63), 0])
def test_a_header_length_is_not_believed(path, length):
    path.write_bytes(struct.pack("<q", length) + path.read_bytes()[8:])
    with pytest.raises(CaptureError, match=f"header of {length}"):
        read_b3d(path)


@pytest.mark.parametrize(
    "change", [{"raw_sensor_frame_size": 2**31 - 1}, {"processing_pass_frame_size": -8}, {"num_trials": 3}]
)
def test_other_sizes_are_not_believed_either(subject, path, change):
    header = encode_message(replace(read_b3d(path).header, **change))
    path.write_bytes(struct.pack("<q", len(header)) + header + path.read_bytes()[-400:])
    with pytest.raises(CaptureError, match=r"cut off|negative size|counts 3 trials"):
        read_b3d(path)


def test_a_trial_that_is_longer_than_anything(subject, path):
    header = read_b3d(path).header
    long = replace(header.trial_header[0], trial_length=2**31 - 1)
    data = encode_message(replace(header, trial_header=(long,)))
    path.write_bytes(struct.pack("<q", len(data)) + data + bytes(1000))
    with pytest.raises(CaptureError, match=r"asks for \d{11,} bytes of frames, and 1000 follow"):
        read_b3d(path)


@pytest.mark.parametrize("content", [b"", b"<html>", b"PK\x03\x04" + bytes(200), b"Versions: 3\n" * 50])
def test_foreign_files(path, content):
    path.write_bytes(content)
    with pytest.raises(CaptureError, match=r"no \.b3d file"):
        read_b3d(path)


def test_a_missing_file_and_a_folder(tmp_path):
    with pytest.raises(CaptureError, match="cannot be read"):
        read_b3d(tmp_path / "none.b3d")
    with pytest.raises(CaptureError, match=r"cannot be read|no \.b3d file"):
        read_b3d(tmp_path)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_damage_is_an_error_of_ours_or_goes_unnoticed(data, subject, tmp_path):
    path = tmp_path / "subject.b3d"
    write_b3d(subject, path)
    whole = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(whole)
    with suppress(CaptureError):
        open_all(path)


def test_damage_inside_a_trial_is_placed_and_leaves_the_others_readable(path):
    whole = bytearray(path.read_bytes())
    read = read_b3d(path).header
    whole[-read.processing_pass_frame_size] ^= 0xFF  # the first tag of the last pass frame
    path.write_bytes(whole)
    trials = read_b3d(path).trials
    assert trials[0].passes[0].pos.shape == (3, 2)
    with pytest.raises(CaptureError, match="trial 1 'trial 1': frame 4"):
        trials[1]


def test_a_series_that_the_header_does_not_describe(subject, path):
    header = replace(read_b3d(path).header, marker_name=("C7", "T10"))
    data = encode_message(header)
    frames = sum(
        trial.trial_length * (header.raw_sensor_frame_size + header.processing_pass_frame_size)
        for trial in header.trial_header
    )
    path.write_bytes(struct.pack("<q", len(data)) + data + path.read_bytes()[-frames:])
    with pytest.raises(CaptureError, match="marker_obs has 3 numbers a frame, but 2 marker names ask for 6"):
        open_all(path)


def test_one_trial_of_a_huge_file_is_read_without_the_others(subject, path):
    read = read_b3d(path)
    stride = read.header.raw_sensor_frame_size + read.header.processing_pass_frame_size
    frames = 2**33 // stride  # eight gigabytes
    first = read.header.trial_header[0]
    huge = replace(read.header.trial_header[1], trial_length=frames, missing_GRF_reason=np.zeros(0, np.int32))
    data = encode_message(replace(read.header, trial_header=(first, huge)))
    own = path.read_bytes()[-8 * stride :][: 3 * stride]
    expected = np.array(read.trials[0].passes[0].pos)
    path.write_bytes(struct.pack("<q", len(data)) + data + own)
    os.truncate(path, 8 + len(data) + (3 + frames) * stride)  # a hole: it takes no room on the disk
    np.testing.assert_array_equal(read_b3d(path).trials[0].passes[0].pos, expected)


def test_series_cannot_be_written_into(path):
    with pytest.raises(ValueError, match="read-only"):
        read_b3d(path).trials[0].passes[0].pos[0, 0] = 1.0
