"""Arrays that a file only claims to hold are not allocated."""

import io
import resource
import zipfile

import numpy as np
import pytest

from solver.common import npz
from solver.common.npz import stored_arrays


@pytest.fixture
def little_memory():
    """No array of 8 GiB can be had, so that a reader that tries fails with a MemoryError."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (6 << 30, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def packed(path, header, data, compression=zipfile.ZIP_STORED):
    with zipfile.ZipFile(path, "w", compression) as file:
        content = io.BytesIO()
        np.lib.format.write_array_header_1_0(content, header)
        file.writestr("a.npy", content.getvalue() + data)
    return path


def test_what_was_saved_comes_back(tmp_path):
    arrays = {"a.b": np.arange(6.0).reshape(2, 3), "t": np.array("Zoë"), "f": np.asfortranarray(np.eye(3))}
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", **arrays)
        back = stored_arrays(tmp_path / "a.npz")
        assert list(back) == list(arrays)
        for name, array in arrays.items():
            np.testing.assert_array_equal(back[name], array)
        assert list(stored_arrays(tmp_path / "a.npz", "t")) == ["t"]


@pytest.mark.parametrize("shape", [(1 << 30,), (2, 1 << 29), (0, 1 << 30), (1 << 70,)])
def test_a_shape_that_the_file_does_not_hold_is_refused_before_it_is_allocated(
    tmp_path, little_memory, shape
):
    path = packed(tmp_path / "a.npz", {"descr": "<f8", "fortran_order": False, "shape": shape}, b"12345678")
    with pytest.raises(ValueError, match=r"array 'a\.npy' of shape"):
        stored_arrays(path)


def test_nothing_is_inflated_beyond_a_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(npz, "MOST_INFLATED_BYTES", 10_000)
    header = {"descr": "<f8", "fortran_order": False, "shape": (10_000,)}
    path = packed(tmp_path / "a.npz", header, bytes(80_000), zipfile.ZIP_DEFLATED)
    assert path.stat().st_size < 1000
    with pytest.raises(ValueError, match="compressed arrays take"):
        stored_arrays(path)


def test_nothing_is_unpickled(tmp_path):
    np.savez(tmp_path / "a.npz", a=np.array([{"a": 1}], dtype=object))
    with pytest.raises(ValueError, match=r"Object arrays|holds"):
        stored_arrays(tmp_path / "a.npz")


@pytest.mark.parametrize("content", [b"", b"PK", b"no archive at all"])
def test_what_is_no_archive_is_a_value_error(tmp_path, content):
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(ValueError, match=r"\w"):
        stored_arrays(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", a=np.zeros(3))
    with pytest.raises(ValueError, match="no array 'tree'"):
        stored_arrays(tmp_path / "b.npz", "tree")
