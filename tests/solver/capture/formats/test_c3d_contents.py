import shutil
from contextlib import suppress
from resource import RUSAGE_SELF, getrusage

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from solver.capture.formats.c3d_contents import open_c3d, read_data, read_header
from solver.common.errors import CaptureError

LASEM = "c3d_lab_trials/lasem_FAILT01/FAILT01_SLDJ06.c3d"
SMALL = "c3d_conformance/ezc3d/FP_Type3.c3d"


@pytest.mark.parametrize("share", [0.00001, 0.0005, 0.002, 0.01, 0.03, 0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("name", [LASEM, "c3d_conformance/c3dorg_sample02/pc_int.c3d"])
def test_a_file_that_was_cut_off(real_data, tmp_path, name, share):
    whole = (real_data / name).read_bytes()
    path = tmp_path / "cut.c3d"
    path.write_bytes(whole[: max(1, int(len(whole) * share))])
    with pytest.raises(CaptureError, match=r"cut\.c3d: .*(cut off|ends after|damaged)"):
        open_c3d(path)


def test_a_file_that_ends_with_a_whole_frame_was_trimmed(real_data):
    contents = open_c3d(real_data / "c3d_conformance/ezc3d/Optotrak.c3d")
    assert len(contents.points) == 29
    assert any("1149 frames, the file holds 29" in note for note in contents.notes)


@pytest.mark.parametrize("text", [b"not a c3d file at all, but long enough to be one" * 50, bytes(2000)])
def test_other_files(tmp_path, text):
    path = tmp_path / "other.c3d"
    path.write_bytes(text)
    with pytest.raises(CaptureError, match="not a C3D file"):
        read_header(path)


def test_missing_file_and_folder(tmp_path):
    for path in (tmp_path / "none.c3d", tmp_path):
        with pytest.raises(CaptureError, match="cannot be read"):
            read_header(path)


def test_a_parameter_with_impossible_dimensions_is_found_before_ezc3d_ends_the_program(real_data, tmp_path):
    data = bytearray((real_data / SMALL).read_bytes())
    rate = data.index(b"RATE\x1b\x00\x04\x00")
    data[rate + 7] = 134  # number of dimensions
    path = tmp_path / "damaged.c3d"
    path.write_bytes(data)
    with pytest.raises(CaptureError, match="damaged at byte"):
        read_header(path)


def test_a_parameter_that_reaches_beyond_the_file(real_data, tmp_path):
    data = bytearray((real_data / SMALL).read_bytes())
    channel = data.index(b"CHANNEL")
    dimensions = data.index(b"\x02\x02", channel)  # integers in two dimensions
    data[dimensions + 2 : dimensions + 4] = b"\xff\xff"
    path = tmp_path / "damaged.c3d"
    path.write_bytes(data)
    with pytest.raises(CaptureError, match="damaged at byte"):
        read_header(path)


@pytest.mark.parametrize("name", [b"\x02SCALE_\x00", b"\x06\x02OFFSET4"])
def test_analog_samples_without_scale_or_offset(real_data, tmp_path, name):
    data = (real_data / SMALL).read_bytes()
    assert data.count(name) == 1
    path = tmp_path / "unscaled.c3d"
    path.write_bytes(data.replace(name, name.replace(b"S", b"Q", 1)))
    with pytest.raises(CaptureError, match=r"ANALOG:(SCALE|OFFSET) missing"):
        read_header(path)


def test_the_data_section_decoded_by_the_header_alone_agrees_with_ezc3d(real_data, tmp_path):
    for name in (LASEM, "c3d_conformance/c3dorg_sample02/pc_int.c3d"):
        path = shutil.copy(real_data / name, tmp_path)
        contents = open_c3d(real_data / name)
        stored = read_data(path, read_header(real_data / name))
        np.testing.assert_allclose(stored.points, contents.points, atol=1e-4)
        assert stored.analogs.shape == contents.analogs.shape
    real = open_c3d(real_data / LASEM)  # its analog scales are 1
    np.testing.assert_allclose(read_data(real.path, read_header(real.path)).analogs, real.analogs, atol=1e-9)


@pytest.mark.parametrize("extents", [(0, 255, 255), (255, 255, 255), (0, 255, 255, 255, 255)])
def test_a_parameter_with_lying_extents_takes_no_room(real_data, tmp_path, extents):
    data = bytearray((real_data / LASEM).read_bytes())
    labels = data.index(b"LABELS", data.index(b"ANALOG")) + len(b"LABELS") + 2
    data[labels + 1 : labels + 2 + len(extents)] = bytes([len(extents), *extents])
    path = tmp_path / "lying.c3d"
    path.write_bytes(data)
    before = getrusage(RUSAGE_SELF).ru_maxrss
    with pytest.raises(CaptureError, match=r"lying\.c3d: .* damaged"):
        open_c3d(path)
    assert getrusage(RUSAGE_SELF).ru_maxrss - before < 100_000  # [kB]


@pytest.mark.parametrize("said", [0, 1, 32, 119])
def test_a_header_that_counts_too_few_analog_samples_is_told_and_no_marker_moves(real_data, tmp_path, said):
    data = bytearray((real_data / LASEM).read_bytes())
    data[4:6] = said.to_bytes(2, "little")
    path = tmp_path / "changed.c3d"
    path.write_bytes(data)
    contents = open_c3d(path)
    assert any(f"the header counts {said} analog values" in note for note in contents.notes)
    np.testing.assert_array_equal(contents.points, open_c3d(real_data / LASEM).points)


@pytest.mark.parametrize("said", [65, 4000, 65535])
def test_a_header_that_counts_too_many_analog_samples_is_refused(real_data, tmp_path, said):
    data = bytearray((real_data / SMALL).read_bytes())
    data[4:6] = said.to_bytes(2, "little")
    path = tmp_path / "changed.c3d"
    path.write_bytes(data)
    with pytest.raises(CaptureError, match=r"changed\.c3d: .*(cut off|disagree)"):
        open_c3d(path)


@pytest.mark.parametrize("letters", [128, 255])
def test_a_description_longer_than_can_be_read_is_told_and_takes_no_room(real_data, tmp_path, letters):
    data = bytearray((real_data / SMALL).read_bytes())
    rate = data.index(b"RATE\x1b\x00\x04\x00") + len(b"RATE")
    old = data[rate + 8]
    data[rate + 8 : rate + 9 + old] = bytes([letters, *b"d" * letters])
    data[rate : rate + 2] = (0x1B + letters - old).to_bytes(2, "little")
    path = tmp_path / "told.c3d"
    path.write_bytes(data)
    before = getrusage(RUSAGE_SELF).ru_maxrss
    with pytest.raises(CaptureError, match=f"the description of RATE has {letters} letters"):
        open_c3d(path)
    assert getrusage(RUSAGE_SELF).ru_maxrss - before < 100_000  # [kB]


def test_frames_that_end_before_they_begin(real_data, tmp_path):
    data = bytearray((real_data / SMALL).read_bytes())
    data[6:10] = b"\x09\x00\x02\x00"
    path = tmp_path / "backwards.c3d"
    path.write_bytes(data)
    with pytest.raises(CaptureError, match="the header is damaged: frames 9 to 2"):
        open_c3d(path)


@given(st.data())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_headers_and_parameters_are_read_or_told_in_a_sentence(real_data, tmp_path, data):
    whole = bytearray((real_data / SMALL).read_bytes())
    places = st.one_of(st.integers(0, 48), st.integers(512, len(whole) - 1024))
    values = st.one_of(
        st.sampled_from([b"\0", b"\xff", b"\x7f", b"\0\0", b"\xff\xff"]), st.binary(min_size=1, max_size=4)
    )
    for place, value in data.draw(st.lists(st.tuples(places, values), min_size=1, max_size=3)):
        whole[place : place + len(value)] = value
    path = tmp_path / "damaged.c3d"
    path.write_bytes(whole[: data.draw(st.one_of(st.none(), st.integers(0, len(whole))))])
    with suppress(CaptureError):
        open_c3d(path)
