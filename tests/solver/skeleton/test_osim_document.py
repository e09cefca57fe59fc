"""Files that are no models, or no XML at all."""

import base64
import re
import time
import tracemalloc
import zlib

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.mesh_files import read_vtp
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_document import read_document

ENTITIES = '<!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>'
SOON = 20.0  # [s] of processor time; what is refused takes a second, what is not takes minutes
DEEP = b"<a>" * 1_000_000 + b"</a>" * 1_000_000
WIDE = b"<a/>" * 1_500_000
BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a0 "ha">'
    + b"".join(b'<!ENTITY a%d "%b">' % (i + 1, b"&a%d;" % i * 10) for i in range(12))
    + b"]>"
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ENTITIES + "<OpenSimDocument>&b;</OpenSimDocument>", "entity definition"),
        ('<!DOCTYPE m SYSTEM "file:///etc/hosts"><OpenSimDocument/>', "entity definition"),
        ("this is no XML", "not well-formed"),
        ("", "not well-formed"),
        ("<OpenSimDocument>\n<Model>\n<Bo", r"é\.osim:3: not well-formed XML"),
        ('<?xml version="1.0" encoding="shift_jis"?><a/>', "cannot be decoded"),
        ("<html></html>", "root element is <html>"),
        ("<OpenSimDocument><Model/></OpenSimDocument>", "no numeric Version"),
        ('<OpenSimDocument Version="10000"><Model/></OpenSimDocument>', "older than OpenSim 2"),
        ('<OpenSimDocument Version="40000"/>', "no <Model>"),
    ],
)
def test_files_that_are_no_models_get_one_clear_line(tmp_path, text, message):
    path = tmp_path / "a model é.osim"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ModelError, match=message) as caught:
        read_document(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_missing_file_and_a_folder_are_named(tmp_path):
    for path in (tmp_path / "none.osim", tmp_path):
        with pytest.raises(ModelError, match="cannot be read"):
            read_document(path)


def test_elements_know_their_lines(tmp_path):
    path = tmp_path / "lines.osim"
    path.write_text(
        '<OpenSimDocument Version="40000">\n<Model name="m">\n<A/>\n\n<B/></Model></OpenSimDocument>'
    )
    model = read_document(path).model
    assert [(node.tag, node.line) for node in model.iter()] == [("Model", 2), ("A", 3), ("B", 5)]


def model(inside):
    return b'<OpenSimDocument Version="40000"><Model name="m">' + inside + b"</Model></OpenSimDocument>"


def mesh(inside):
    return b'<VTKFile type="PolyData"><PolyData><Piece>' + inside + b"</Piece></PolyData></VTKFile>"


def array(content, *, form=b"ascii"):
    points = b'<Points><DataArray type="Float32" format="%b">%b</DataArray></Points>' % (form, content)
    compressor = b' compressor="vtkZLibDataCompressor"' if form == b"binary" else b""
    return mesh(points).replace(b"<VTKFile", b"<VTKFile" + compressor)


def blocks(count, size, last, packed):
    """A compressed array whose every block unpacks to 8 MB."""
    lead = np.array([count, size, last, *[len(packed)] * count], dtype="<u4").tobytes()
    return base64.b64encode(lead) + base64.b64encode(packed * count)


def refused(read, path, why):
    began = time.process_time()
    with pytest.raises(ModelError, match=f"^{re.escape(str(path))}:.*{why}"):
        read(path)
    assert time.process_time() - began < SOON


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "why"),
    [
        (model(DEEP), "deep within one another"),
        (model(WIDE), "more than 1000000 elements"),
        (model(b"<a " + b" ".join(b'a%d=""' % i for i in range(1_100_000)) + b"/>"), "and attributes"),
        (model(b"<credits>" + b"x" * 2_000_000 + b"</credits>"), "characters"),
        (model(b" " * 33 * 2**20), "larger than 32 MB"),
        (BOMB + model(b"&a12;"), "entity definition"),
        (
            BOMB.replace(b"a0 ", b'a0 SYSTEM "file:///etc/passwd" ').replace(b'"ha"', b"") + model(b""),
            "entity",
        ),
    ],
    ids=["deep", "wide", "attributes", "long text", "large", "entities within entities", "a file's content"],
)
def test_a_hostile_model_is_refused(tmp_path, content, why):
    path = tmp_path / "model.osim"
    path.write_bytes(content)
    refused(load_skeleton, path, why)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (mesh(DEEP), "deep within one another"),
        (mesh(WIDE), "more than 1000000 elements"),
        (BOMB + mesh(b"&a12;"), "DTD"),
        (array(b"1 " * 5_000_000), "more than 4000000 numbers"),
        (mesh(b"") + b"<AppendedData>_" * 200_000, "not a readable"),
        (mesh(b"") + b"<AppendedData " * 400_000, "not a readable"),
        (array(blocks(1_000_000, 0, 1, b""), form=b"binary"), "compressed blocks"),
    ],
    ids=["deep", "wide", "entities", "numbers", "unended blocks", "unended tags", "empty blocks"],
)
def test_a_hostile_mesh_is_refused(tmp_path, content, why):
    path = tmp_path / "bone.vtp"
    path.write_bytes(content)
    refused(read_vtp, path, why)


def test_all_blocks_together_hold_no_more_than_they_announce(tmp_path):
    path = tmp_path / "bone.vtp"
    path.write_bytes(array(blocks(50, 0, 2**23, zlib.compress(bytes(2**23))), form=b"binary"))
    tracemalloc.start()
    try:
        refused(read_vtp, path, "not a readable")
        assert tracemalloc.get_traced_memory()[1] < 5 * 2**23
    finally:
        tracemalloc.stop()
