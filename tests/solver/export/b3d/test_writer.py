"""Written and read again; what cannot be written is refused, and leaves the previous file as it was."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.formats.b3d.b3d_fields import B3dFile, Header, PassFrames, SensorFrames
from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.common.errors import CaptureError


def with_second(subject, **changes) -> B3dFile:
    first, second = subject.trials
    return replace(subject, trials=(first, replace(second, **changes)))


def test_everything_comes_back(subject, tmp_path, same):
    path = tmp_path / "subject.b3d"
    write_b3d(subject, path)
    found = read_b3d(path)
    sizes = {
        "raw_sensor_frame_size": found.header.raw_sensor_frame_size,
        "processing_pass_frame_size": found.header.processing_pass_frame_size,
    }
    same(found.header, replace(subject.header, **sizes))
    for trial, expected in zip(found.trials, subject.trials, strict=True):
        same(trial.header, expected.header)
        same(np.array(trial.sensors.marker_obs), expected.sensors.marker_obs)
        same(np.array(trial.passes[0].pos), expected.passes[0].pos)
        assert trial.passes[0].vel.shape == (trial.header.trial_length, 0)


def test_the_layout_on_the_disk(subject, tmp_path):
    """Header length, header, then per frame sensors and pass: 2 + 24 bytes a field of three doubles."""
    path = tmp_path / "subject.b3d"
    write_b3d(subject, path)
    data = path.read_bytes()
    header = int.from_bytes(data[:8], "little")
    assert len(data) == 8 + header + 8 * ((2 + 24) * 2 + (2 + 16) * 2)
    frame = data[8 + header :]
    assert frame[:2] == bytes([0x12, 24])  # field 2, 24 bytes: one marker
    np.testing.assert_array_equal(np.frombuffer(frame[2:26]), subject.trials[0].sensors.marker_obs[0])
    assert frame[52:54] == bytes([0x0A, 16])  # field 1 of the pass: two dofs
    np.testing.assert_array_equal(np.frombuffer(frame[54:70]), subject.trials[0].passes[0].pos[0])


def test_over_the_file_it_was_read_from(subject, tmp_path):
    path = tmp_path / "subject.b3d"
    write_b3d(subject, path)
    before = path.read_bytes()
    write_b3d(read_b3d(path), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_in_pieces(subject, tmp_path, monkeypatch):
    write_b3d(subject, tmp_path / "whole.b3d")
    monkeypatch.setattr("solver.capture.formats.b3d.b3d_file.FRAMES_AT_ONCE", 2)
    write_b3d(subject, tmp_path / "pieces.b3d")
    assert (tmp_path / "pieces.b3d").read_bytes() == (tmp_path / "whole.b3d").read_bytes()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"sensors": SensorFrames(marker_obs=np.zeros((5, 6)))},
            "6 numbers a frame, but 1 marker names ask for 3",
        ),
        ({"sensors": SensorFrames(marker_obs=np.zeros((4, 3)))}, "4 frames instead of 5"),
        ({"sensors": SensorFrames(marker_obs=np.zeros((5, 3)))}, "other series"),
        ({"passes": (PassFrames(pos=np.zeros((5, 2))),)}, "other series"),
        ({"passes": ()}, "0 passes, but headers for 1"),
    ],
)
def test_what_does_not_fit_together(subject, tmp_path, changes, message):
    path = tmp_path / "subject.b3d"
    path.write_bytes(b"old")
    with pytest.raises(CaptureError, match=f"trial 1 'trial 1': .*{message}"):
        write_b3d(with_second(subject, **changes), path)
    assert path.read_bytes() == b"old"


def test_a_value_of_the_wrong_kind(subject, tmp_path):
    header = replace(subject.header, age_years=2**40)
    with pytest.raises(CaptureError, match="cannot be written as B3D"):
        write_b3d(replace(subject, header=header), tmp_path / "subject.b3d")
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there(subject, tmp_path):
    with pytest.raises(CaptureError, match="choose another output folder"):
        write_b3d(subject, tmp_path / "nowhere" / "subject.b3d")


def test_a_trial_left_out(subject, tmp_path):
    path = tmp_path / "subject.b3d"
    counted = replace(subject, header=replace(subject.header, num_trials=2))
    write_b3d(replace(counted, trials=subject.trials[1:]), path)
    found = read_b3d(path)
    assert (found.header.num_trials, [t.name for t in found.header.trial_header]) == (1, ["trial 1"])
    np.testing.assert_array_equal(found.trials[0].passes[0].pos, subject.trials[1].passes[0].pos)


def test_no_trials(tmp_path):
    write_b3d(B3dFile(Header(version=4), ()), tmp_path / "empty.b3d")
    assert len(read_b3d(tmp_path / "empty.b3d").trials) == 0
