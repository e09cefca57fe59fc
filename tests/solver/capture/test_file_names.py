"""Two names never give one file, and names are read whatever bytes they are."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.capture.capture import Markers
from solver.capture.formats.c3d import read_c3d
from solver.capture.formats.storage import read_storage, write_storage
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.subject.opened_subject import open_subject
from solver.capture.subject.subject_toml import described_as_toml
from solver.common.file_names import LONGEST_BYTES, decoded, distinct, encoded, lying, readable
from solver.export.export_places import file_stem


def test_names_that_look_alike_get_numbers_and_a_plain_one_keeps_its_own():
    names = ["walk(1)", "walk[1]", "walk_1_", "Walk 1 ", "Müller", "Möller", "run"]
    assert distinct(names, file_stem) == {
        "walk(1)": "walk_1_-2",
        "walk[1]": "walk_1_-3",
        "walk_1_": "walk_1_",
        "Walk 1 ": "Walk_1_-4",
        "Müller": "M_ller",
        "Möller": "M_ller-2",
        "run": "run",
    }


@given(st.lists(st.text(min_size=1), unique=True))
def test_no_two_stems_are_one_file_even_where_capitals_do_not_count(names):
    stems = distinct(names, file_stem)
    assert list(stems) == names
    assert len({stem.casefold() for stem in stems.values()}) == len(names)
    assert all(len(stem.encode()) <= LONGEST_BYTES for stem in stems.values())


NAMES = st.binary(min_size=1, max_size=30).filter(
    lambda raw: not set(raw) & set(b"\0/") and raw.strip(b". ") and not raw.startswith(b".")
)  # what begins with a dot is hidden, and nobody's trial
LABELS = st.text(min_size=1, max_size=8).filter(
    lambda text: readable(text) == text and text.split() == [text]
)


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        (b"L\xe4nge", "Länge"),
        ("Länge".encode(), "Länge"),
        (b"\xef\xbb\xbftime", "time"),
        (b"5 \x80", "5 €"),
        ("ä".encode() + b" \xe4", "ä ä"),
        (b"\x81", "\N{REPLACEMENT CHARACTER}"),
    ],
)
def test_bytes_are_utf8_else_of_the_western_code_page(raw, text):
    assert decoded(raw) == text


@given(st.text(st.characters(), max_size=20))
def test_every_name_can_be_shown_and_written(name):
    shown = readable(name)
    assert shown == readable(shown)
    assert shown.encode().decode() == shown
    assert not any(sign in shown for sign in "\n\t\0\x85")
    assert len(shown) == len(name)
    assert len(encoded(name).decode()) == len(name)


@given(NAMES)
@settings(max_examples=40, deadline=None)
def test_a_folder_and_a_file_of_any_name_are_found_by_the_name_that_is_shown(raw):
    with TemporaryDirectory() as place:
        file = Path(place, os.fsdecode(raw), os.fsdecode(raw) + ".trc")
        file.parent.mkdir()
        file.touch()
        assert lying(Path(place), readable(file.relative_to(place).as_posix())) == file


@given(NAMES)
@settings(max_examples=40, deadline=None)
def test_a_subject_of_any_name_is_described_and_read_back(raw):
    with TemporaryDirectory() as place:
        folder = Path(place, os.fsdecode(raw))
        (folder / "trials" / folder.name).mkdir(parents=True)
        markers = Markers(("A",), np.ones((2, 1, 3)), 100.0)
        write_trc(folder / "trials" / folder.name / "markers.trc", markers)
        found = open_subject(folder)
        (folder / "subject.toml").write_bytes(encoded(described_as_toml(found)))
        again = open_subject(folder)
        assert again.trials == found.trials
        assert readable(again.name + again.trials[0].name).encode()


@given(st.lists(LABELS, min_size=1, max_size=4, unique=True))
@settings(max_examples=40, deadline=None)
def test_labels_in_tables_of_either_coding_are_the_same(labels):
    with TemporaryDirectory() as place:
        trc, mot = Path(place, "a.trc"), Path(place, "a.mot")
        write_trc(trc, Markers(tuple(labels), np.arange(6.0 * len(labels)).reshape(2, -1, 3) % 2, 100.0))
        write_storage(mot, labels, np.arange(2.0), np.ones((2, len(labels))))
        assert read_trc(trc).markers.names == tuple(labels)
        assert read_storage(mot).labels == tuple(labels)
        for file in (trc, mot):
            file.write_bytes(file.read_text(encoding="utf-8").encode("cp1252", errors="replace"))
        coded = [label.encode("cp1252", errors="replace") for label in labels]
        western = tuple(label.decode("cp1252") for label in coded)
        if len(set(western)) == len(western) and all(
            decoded(label) == label.decode("cp1252") for label in coded
        ):
            assert read_trc(trc).markers.names == western
            assert read_storage(mot).labels == western


@pytest.mark.parametrize("byte", [0xE4, 0xF1, 0x9A, 0x81, 0xC3, 0x09, 0x0A, 0x7F])
def test_a_label_of_a_c3d_file_with_any_byte_can_be_written(write_c3d, tmp_path, byte):
    folder = tmp_path / os.fsdecode(b"Z\xfcrich")
    folder.mkdir()
    plain = write_c3d(
        tmp_path / "plain.c3d", 300.0 * np.arange(18.0).reshape(3, 2, 3) % 1700, ["LANG", "KNIE"]
    )
    file = folder / os.fsdecode(b"g\xe9t.c3d")
    file.write_bytes(plain.read_bytes().replace(b"LANG", b"L%cNG" % byte))
    shown = bytes([byte]).decode("cp1252", errors="replace") if byte > 0x7F else " "
    markers = read_c3d(file).markers
    assert markers.names == (f"L{shown}NG", "KNIE")
    write_trc(tmp_path / "again.trc", markers)
    assert read_trc(tmp_path / "again.trc").markers.names == markers.names
