"""Small files that break readers, and trials of like names, beside real walks."""

import csv
import io
import resource
import shutil
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from solver.common.errors import ResultsError
from solver.fitting.results.store import load_fit
from tests.addb_viewer.shell import run

pytestmark = pytest.mark.real

MOST_BYTES = 6 << 30  # less than the array that a file claims to hold
SOON_S = 20.0  # of the processor: as long as a few imports take, and far below a parser that hangs


@pytest.fixture
def folder(two_walks, tmp_path):
    return shutil.copytree(two_walks, tmp_path / "walks")


def rows(file):
    return len(list(csv.reader(file.open(newline="")))) - 1


@pytest.mark.parametrize("name", ["settings.toml", "subject.toml"])
@pytest.mark.parametrize(
    "text",
    ["a = " + "[" * 100_000, "a = " + "{a=" * 50_000, ".".join(["a"] * 100_000) + " = 1"],
    ids=["brackets", "braces", "dotted keys"],
)
def test_a_hostile_file_beside_a_recording_is_refused_by_name_and_at_once(folder, name, text):
    (folder / name).write_text(text)
    began = time.process_time()
    said = run("fit", folder)
    assert time.process_time() - began < SOON_S
    assert said.exit_code != 0
    assert name in said.output
    assert "nested more than" in said.output
    assert "unexpected" not in said.output


def test_a_fit_whose_array_claims_8_gib_is_refused_before_memory_is_asked_for(folder):
    file = folder / "results" / next(f for f in (folder / "results").rglob("part1.npz"))
    with zipfile.ZipFile(file) as packed:
        arrays = {name: packed.read(name) for name in packed.namelist()}
    header = io.BytesIO()
    huge = {"descr": "<f8", "fortran_order": False, "shape": (1 << 30,)}
    np.lib.format.write_array_header_1_0(header, huge)
    arrays[next(name for name, array in arrays.items() if len(array) > 10_000)] = header.getvalue() + bytes(8)
    with zipfile.ZipFile(file, "w") as packed:
        for name, array in arrays.items():
            packed.writestr(name, array)
    before = resource.getrlimit(resource.RLIMIT_AS)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + MOST_BYTES, before[1]))
    try:
        with pytest.raises(ResultsError, match=r"part1\.npz"):
            load_fit(folder / "results", folder)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def test_trials_whose_names_look_alike_are_exported_into_files_of_their_own(folder):
    trials = (folder / "subject.toml").read_text()
    trials = trials.replace("[trials.part1]", '[trials."walk(1)"]').replace(
        "[trials.part2]", '[trials."walk[1]"]'
    )
    (folder / "subject.toml").write_text(trials)
    assert run("fit", folder).exit_code == 0
    said = run("export", folder, "--to", "csv")
    assert said.exit_code == 0, said.output
    files = sorted((folder / "results" / "csv").glob("*.csv"))
    assert [file.name for file in files] == ["walk_1_-2.csv", "walk_1_.csv"]
    assert sorted(map(rows, files)) == [100, 106]
    assert "trial 'walk[1]' is written as walk_1_-2" in said.output


def test_trials_whose_names_subject_toml_exchanges_are_exported_under_their_new_names(folder):
    before = run("export", folder, "--to", "csv")
    assert before.exit_code == 0, before.output
    exported = folder / "results" / "csv"
    first, second = (rows(exported / f"{name}.csv") for name in ("part1", "part2"))
    assert first != second
    trials = (folder / "subject.toml").read_text()
    for old, new in (("[trials.part1]", "-"), ("[trials.part2]", "[trials.part1]"), ("-", "[trials.part2]")):
        trials = trials.replace(old, new, 1)
    (folder / "subject.toml").write_text(trials)
    assert run("fit", folder).exit_code == 0
    said = run("export", folder, "--to", "csv")
    assert said.exit_code == 0, said.output
    assert [rows(exported / f"{name}.csv") for name in ("part1", "part2")] == [second, first]


OWN_FILES = ("subject.toml", "_subject.json", "markers.toml", "settings.toml")


@pytest.mark.parametrize("name", OWN_FILES)
@pytest.mark.parametrize("kind", ["link to nowhere", "folder", "other case"])
def test_what_bears_the_name_of_a_description_and_is_not_read_is_told(folder, name, kind):
    (folder / name).unlink(missing_ok=True)
    match kind:
        case "link to nowhere":
            (folder / name).symlink_to(folder / "unmounted" / name)
        case "folder":
            (folder / name).mkdir()
        case _:
            (folder / name.upper()).write_text("")
    said = run("fit", folder)
    assert said.exit_code == 1
    assert f"{folder / name}: " in said.output.replace("\n", "")
