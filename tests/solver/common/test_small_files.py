"""Files that are made to hang or to break a parser are refused at once, by name; sound ones are read."""

import json
import time

import pytest

from solver.capture.subject.description import read_json, read_toml
from solver.common.errors import CaptureError, SettingsError
from solver.common.small_files import MOST_TOML_BYTES, BrokenFileError, json_content, toml_tables
from solver.fitting.settings import Settings, as_toml, read_settings
from solver.markers.mapping_file import read_map

HOSTILE = {
    "brackets": "a = " + "[" * 100_000,
    "closed brackets": "a = " + "[" * 100_000 + "]" * 100_000,
    "braces": "a = " + "{a=" * 50_000,
    "dotted keys": ".".join(["a"] * 100_000) + " = 1",
    "dotted table": "[" + ".".join(["a"] * 100_000) + "]",
    "quoted dotted keys": ".".join(['"a"'] * 100_000) + " = 1",
    "digits": "a = " + "9" * 100_000,
    "half a text": 'a = "' + '\\"' * 100_000,
    "many bytes": "#" * (MOST_TOML_BYTES + 1),
    "no text": "a = 1\n\udcff",
}


@pytest.mark.parametrize("kind", HOSTILE)
@pytest.mark.parametrize(
    ("read", "error"), [(read_settings, SettingsError), (read_map, CaptureError), (read_toml, CaptureError)]
)
def test_a_hostile_toml_file_is_refused_at_once_and_by_name(tmp_path, kind, read, error):
    path = tmp_path / "settings.toml"
    path.write_text(HOSTILE[kind], encoding="utf-8", errors="surrogateescape")
    began = time.process_time()
    with pytest.raises(error, match=r"settings\.toml"):
        read(path)
    assert time.process_time() - began < 5.0


def test_the_worst_file_that_is_let_through_takes_seconds_at_most(tmp_path):
    deepest = ".".join(["a"] * 60)
    lines = [f"{deepest}.k{i} = 1" for i in range(MOST_TOML_BYTES // (len(deepest) + 12))]
    (tmp_path / "a.toml").write_text("\n".join(lines))
    began = time.process_time()
    toml_tables(tmp_path / "a.toml")
    assert time.process_time() - began < 20.0


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"a":' * 100_000, "9" * 100_000, "{", "\udcff", '{"a": 1} x']
)
def test_a_hostile_json_file_is_refused_by_name(tmp_path, text):
    path = tmp_path / "subject.json"
    path.write_text(text, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(BrokenFileError):
        json_content(path)
    with pytest.raises(CaptureError, match=r"subject\.json"):
        read_json(path)


def test_brackets_and_dots_in_texts_and_comments_are_no_depth(tmp_path):
    path = tmp_path / "a.toml"
    brackets, dots = "[" * 200, "a." * 200
    texts = [f'a = "{brackets}"', f"b = '{dots}'", f'c = """\n{brackets}\n\\"""x"""', f"# {brackets} {dots}"]
    path.write_text("\n".join([*texts, "d = [[1.5, 2.5], [3.5]]", 'e.f."g.h" = 1']))
    assert toml_tables(path)["d"] == [[1.5, 2.5], [3.5]]
    path.write_text(as_toml(Settings()))
    assert read_settings(path) == Settings()


def test_json_with_a_byte_order_mark(tmp_path):
    (tmp_path / "a.json").write_text("\ufeff" + json.dumps({"a": [1.5]}), encoding="utf-8")
    assert json_content(tmp_path / "a.json") == {"a": [1.5]}
