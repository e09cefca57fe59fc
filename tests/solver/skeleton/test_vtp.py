"""VTP files written here byte by byte, in every layout that VTK knows."""

import base64
import struct
import zlib

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.vtp import read_vtp

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 2]], dtype=float)
QUAD_AND_TRIANGLE = [[0, 1, 2, 3], [0, 1, 4]]
TRIANGLES = {(0, 1, 2), (0, 2, 3), (0, 1, 4)}


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
