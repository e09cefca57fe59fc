import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from solver.capture.atomic import DRAFT
from solver.common.errors import ModelError
from solver.skeleton.mesh_files import MeshSettings, cache_folder, load_mesh


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def ball(tmp_path) -> Path:
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=5, radius=0.1).export(path)
    return path


def test_thinned_and_still_the_same_body(ball):
    mesh = load_mesh(ball)
    settings = MeshSettings()
    expected = (
        settings.triangles_per_square_metre * 4 * np.pi * 0.01 + settings.triangles_per_metre * 0.2 * 3**0.5
    )
    assert len(mesh.faces) == pytest.approx(expected, rel=0.02)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 0.1, atol=1e-3)


def test_small_meshes_stay_as_they_are(tmp_path):
    path = tmp_path / "box.obj"
    trimesh.creation.box(extents=(0.1, 0.2, 0.3)).export(path)
    assert len(load_mesh(path).faces) == 12


def test_second_time_comes_from_the_disk(ball, monkeypatch):
    first = load_mesh(ball)
    monkeypatch.setattr("solver.skeleton.mesh_files._read", lambda path: pytest.fail("read again"))
    again = load_mesh(ball)
    np.testing.assert_allclose(again.vertices, first.vertices, atol=1e-7)
    np.testing.assert_array_equal(again.faces, first.faces)


def test_other_content_or_settings_are_another_mesh(ball):
    before = len(load_mesh(ball).faces)
    assert len(load_mesh(ball, MeshSettings(most_triangles=100)).faces) <= 110
    trimesh.creation.box(extents=(0.1, 0.2, 0.3)).export(ball)
    assert len(load_mesh(ball).faces) == 12 != before


@pytest.mark.parametrize("rubbish", [b"", b"PK\x03\x04 half a file"])
def test_a_spoilt_cache_is_made_again(ball, rubbish):
    first = load_mesh(ball)
    (kept,) = (cache_folder() / "bones").iterdir()
    kept.write_bytes(rubbish)
    assert len(load_mesh(ball).faces) == len(first.faces)


def test_an_unwritable_cache_does_no_harm(ball, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert len(load_mesh(ball).faces) > 0


def test_no_half_written_files_are_left(ball):
    load_mesh(ball)
    assert [p.suffix for p in (cache_folder() / "bones").iterdir()] == [".npz"]


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("bone.stl", b"", "no triangles"),
        ("bone.obj", b"v 0 zero 0\nf 1 1 1\n", "not a readable mesh"),
        ("bone.obj", b"v 0 0 0\n", "no triangles"),
        ("bone.ply", b"ply", r"read from \.vtp, \.obj, \.stl"),
        ("bone.vtp", b"<", "PolyData"),
        ("bone.obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "finite"),
    ],
)
def test_bad_files_are_one_clear_error(tmp_path, name, content, says):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ModelError, match=says):
        load_mesh(path)


def test_missing_and_oversized_files(tmp_path):
    with pytest.raises(ModelError, match="No such file"):
        load_mesh(tmp_path / "none.stl")
    path = tmp_path / "huge.stl"
    path.touch()
    os.truncate(path, MeshSettings().largest_file + 1)
    with pytest.raises(ModelError, match="larger than 64 MB"):
        load_mesh(path)


def test_an_obj_does_not_make_us_open_its_material(tmp_path):
    (tmp_path / "folder").mkdir()
    secret = tmp_path / "folder" / "paint.mtl"
    os.mkfifo(secret)  # whoever opens it for reading waits for ever
    path = tmp_path / "folder" / "bone.obj"
    path.write_text("mtllib paint.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert len(load_mesh(path).faces) == 1


def test_a_full_disk_costs_the_kept_mesh_alone_and_leaves_no_draft(ball, small_disk, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(small_disk.folder))
    bones = cache_folder() / "bones"
    bones.mkdir(parents=True)
    abandoned = bones / f"{DRAFT}killed"
    abandoned.write_bytes(b"half")
    small_disk.fill()
    assert len(load_mesh(ball).faces) > 0
    assert list(bones.iterdir()) == []
