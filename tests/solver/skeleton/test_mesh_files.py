import base64
import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import trimesh

from solver.capture.atomic import DRAFT
from solver.common.errors import ModelError
from solver.skeleton.mesh_files import LARGEST_FILE, cache_folder, load_mesh, read_vtp

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 2]], dtype=float)
QUAD_AND_TRIANGLE = [[0, 1, 2, 3], [0, 1, 4]]
TRIANGLES = {(0, 1, 2), (0, 2, 3), (0, 1, 4)}


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
    expected = 5000 * 4 * np.pi * 0.01 + 800 * 0.2 * 3**0.5
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


def test_other_content_is_another_mesh(ball):
    before = len(load_mesh(ball).faces)
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
    os.truncate(path, LARGEST_FILE + 1)
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


def arrays_of(polygons, order="<"):
    ends = np.cumsum([len(p) for p in polygons])
    return {
        "points": ("Float32", np.asarray(POINTS, dtype=f"{order}f4")),
        "connectivity": ("Int64", np.asarray(np.concatenate(polygons), dtype=f"{order}i8")),
        "offsets": ("Int32", np.asarray(ends, dtype=f"{order}i4")),
    }


def packed(array, *, order="<", header="I", compressed=False, block=16):
    content = array.tobytes()
    if not compressed:
        return struct.pack(order + header, len(content)), content
    blocks = [content[i : i + block] for i in range(0, len(content), block)]
    squeezed = [zlib.compress(b) for b in blocks]
    last = len(blocks[-1]) % block
    lead = struct.pack(order + f"{3 + len(blocks)}{header}", len(blocks), block, last, *map(len, squeezed))
    return lead, b"".join(squeezed)


def document(fields, *, cells="Polys", attributes="", tail=b""):
    def data(name):
        kind, attribute, content = fields[name]
        name_attribute = "" if name == "points" else f' Name="{name}"'
        return f'<DataArray type="{kind}"{name_attribute} {attribute}>{content}</DataArray>'

    body = (
        f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" {attributes}><PolyData>'
        '<Piece NumberOfPoints="5"><PointData><DataArray type="Float32" Name="Normals" format="ascii">9 9 9'
        f"</DataArray></PointData><Points>{data('points')}</Points>"
        f"<{cells}>{data('connectivity')}{data('offsets')}</{cells}></Piece></PolyData>"
    )
    return body.encode() + tail + b"</VTKFile>\n"


def ascii_document(polygons, **options):
    fields = {
        name: (kind, 'format="ascii"', " ".join(map(str, array.ravel().tolist())))
        for name, (kind, array) in arrays_of(polygons).items()
    }
    return document(fields, **options)


def inline_document(*, order="<", header="I", compressed=False, apart=False):
    fields = {}
    for name, (kind, array) in arrays_of(QUAD_AND_TRIANGLE, order).items():
        lead, content = packed(array, order=order, header=header, compressed=compressed)
        apart = apart or compressed
        text = (
            base64.b64encode(lead) + base64.b64encode(content) if apart else base64.b64encode(lead + content)
        )
        fields[name] = (kind, 'format="binary"', "\n   " + text.decode() + "\n")
    attributes = f'byte_order="{"BigEndian" if order == ">" else "LittleEndian"}"'
    attributes += ' header_type="UInt64"' if header == "Q" else ""
    attributes += ' compressor="vtkZLibDataCompressor"' if compressed else ""
    return document(fields, attributes=attributes)


def appended_document(*, raw, compressed):
    fields, block = {}, b""
    for name, (kind, array) in arrays_of(QUAD_AND_TRIANGLE).items():
        lead, content = packed(array, compressed=compressed)
        fields[name] = (kind, f'format="appended" offset="{len(block)}"', "")
        if raw:
            block += lead + content
        elif compressed:
            block += base64.b64encode(lead) + base64.b64encode(content)
        else:
            block += base64.b64encode(lead + content)
    encoding = b"raw" if raw else b"base64"
    tail = b'<AppendedData encoding="' + encoding + b'">\n  _' + block + b"\n</AppendedData>"
    attributes = 'compressor="vtkZLibDataCompressor"' if compressed else ""
    return document(fields, attributes=attributes, tail=tail)


@pytest.mark.parametrize(
    "content",
    [
        ascii_document(QUAD_AND_TRIANGLE),
        inline_document(),
        inline_document(header="Q"),
        inline_document(apart=True),
        inline_document(header="Q", apart=True),
        inline_document(order=">"),
        inline_document(compressed=True),
        inline_document(compressed=True, header="Q"),
        appended_document(raw=True, compressed=False),
        appended_document(raw=True, compressed=True),
        appended_document(raw=False, compressed=False),
        appended_document(raw=False, compressed=True),
    ],
)
def test_every_layout_gives_the_same_surface(tmp_path, content):
    path = tmp_path / "bone.vtp"
    path.write_bytes(content)
    points, triangles = read_vtp(path)
    np.testing.assert_array_equal(points, POINTS)
    assert {tuple(t) for t in triangles.tolist()} == TRIANGLES


def test_strips_keep_their_orientation(tmp_path):
    path = tmp_path / "strip.vtp"
    path.write_bytes(ascii_document([[0, 1, 3, 2]], cells="Strips"))
    points, triangles = read_vtp(path)
    normals = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    )
    assert len(triangles) == 2
    assert np.all(normals[:, 2] > 0)


def test_a_polygon_of_unknown_points_is_refused(tmp_path):
    path = tmp_path / "bone.vtp"
    path.write_bytes(ascii_document([[0, 1, 7]]))
    with pytest.raises(ModelError, match="names point 7, but there are 5"):
        read_vtp(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"solid cube",
        b"<VTKFile type='UnstructuredGrid'></VTKFile>",
        inline_document()[:-200],
        ascii_document(QUAD_AND_TRIANGLE).replace(b"0.5", b"half"),
        inline_document(compressed=True).replace(b"vtkZLib", b"vtkLZMA"),
        b'<!DOCTYPE a [<!ENTITY b "bone">]><VTKFile type="PolyData">&b;</VTKFile>',
    ],
)
def test_what_is_no_mesh_is_one_clear_error(tmp_path, content):
    path = tmp_path / "bone.vtp"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r"bone\.vtp: not a readable VTK PolyData mesh"):
        read_vtp(path)


@pytest.mark.parametrize("claim", [2**31, 2**63 - 1])
def test_an_array_that_claims_more_than_a_bone_holds_is_refused(tmp_path, claim):
    fields = {name: (kind, 'format="ascii"', "0") for name, (kind, _) in arrays_of(QUAD_AND_TRIANGLE).items()}
    fields["points"] = ("Float32", 'format="binary"', base64.b64encode(struct.pack("<Q", claim)).decode())
    path = tmp_path / "bomb.vtp"
    path.write_bytes(document(fields, attributes='header_type="UInt64"'))
    with pytest.raises(ModelError, match="claims"):
        read_vtp(path)


@pytest.mark.parametrize("announced", [12, 0])
def test_a_compressed_block_yields_no_more_than_it_announces(tmp_path, announced):
    bomb = zlib.compress(b"\0" * 10**7)
    lead = struct.pack("<4I", 1, announced, announced, len(bomb))
    fields = {name: (kind, 'format="ascii"', "") for name, (kind, _) in arrays_of([[0, 1, 2]]).items()}
    text = (base64.b64encode(lead) + base64.b64encode(bomb)).decode()
    fields["points"] = ("UInt8", 'format="binary"', text)
    path = tmp_path / "bomb.vtp"
    path.write_bytes(document(fields, attributes='compressor="vtkZLibDataCompressor"'))
    if announced:
        assert len(read_vtp(path)[0]) == announced // 3
    else:
        with pytest.raises(ModelError, match="hold more than it announces"):
            read_vtp(path)
