"""Files that are no models, or no XML at all."""

import pytest

from solver.common.errors import ModelError
from solver.skeleton.osim_document import read_document

ENTITIES = '<!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>'


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
