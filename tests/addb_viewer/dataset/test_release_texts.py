"""What a subject's description says, in the texts of a release: as words, whatever signs it has."""

import os

import numpy as np
import pytest

from addb_viewer.dataset.release_subject import BuildOptions, Terms
from addb_viewer.dataset.release_texts import citations, licences
from addb_viewer.dataset.scanning import scan
from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc


@pytest.mark.parametrize(
    "source", ["a | b", "<script>x</script>", "[x](javascript:y)", "`a`", "two\nlines", "a\\|b"]
)
def test_a_source_is_one_cell_of_words(source):
    row = {"source": source, "licence": "CC-BY-4.0", "consent": "public", "url": "https://x.org/|a"}
    *_, line, end = licences([row]).split("\n")
    assert end == ""
    cells = line.replace("\\\\", "").replace("\\|", "").split("|")
    assert len(cells) == 6, "four cells between five bars"
    for sign in "<>`[]":
        assert sign not in line.replace(f"\\{sign}", "")


def test_braces_of_a_source_end_no_citation():
    text = citations([{"source": "a} {b", "citation": "Somebody {2024}"}])
    assert text.count("{") == text.count("}") == 3


def test_folders_and_files_of_any_bytes_can_stand_in_a_table(tmp_path):
    root = tmp_path / os.fsdecode(b"Z\xfcrich")
    folder = root / os.fsdecode(b"P\xe4ul")
    folder.mkdir(parents=True)
    positions = np.random.default_rng(0).uniform(0, 1.5, (200, 8, 3))
    for name in (b"g\xe9t.trc", b"st\xe4tic static.trc"):
        write_trc(folder / os.fsdecode(name), Markers(tuple("ABCDEFGH"), positions, 100.0))
    subjects, strange = scan(
        [root], BuildOptions(Terms(licence="CC0-1.0", consent="public"), unreviewed=True)
    )
    told = [
        *(one.who.subject_id for one in subjects),
        *(str(left) for one in subjects for left in one.left_out),
    ]
    assert told[0] == "Zürich/Päul"
    assert "stätic static" in "".join(told)
    assert "".join([*told, *map(str, strange)]).encode()
