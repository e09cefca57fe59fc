"""Folders, trials and labels whose names are no UTF-8, or strange signs: solved, kept, shown, found again."""

import json
import os
from dataclasses import replace
from html import unescape

import pytest

from addb_viewer.commands.cli import main
from solver.capture.formats.trc import write_trc
from solver.capture.subject.opened_subject import open_subject
from solver.common.file_names import readable
from solver.fitting.provenance import provenance_of
from solver.fitting.settings import as_dict

BY_PROGRAM = {
    "Latin-1": b"Gangl\xe4hmung \xdf",
    "central Europe": b"krok \xb9\xe6\xea",
    "Shift-JIS": b"\x95\xe0\x8ds",
    "decomposed accents": "Schönheit".encode().replace("ö".encode(), b"o\xcc\x88"),
    "signs": "a'b\"c<i>&\\#%1, ½ 🦶".encode(),
    "control characters": b"one\ntwo\tthree",
}


@pytest.fixture(params=BY_PROGRAM.values(), ids=BY_PROGRAM)
def named(request, small_fit, tmp_path, monkeypatch):
    """A folder and its trial called by the same bytes; a label as well, as far as a table has it."""
    name = os.fsdecode(request.param)
    folder = tmp_path / name
    folder.mkdir()
    markers = small_fit.trials[0].capture.markers
    write_trc(folder / "written.trc", replace(markers, names=("ASIS", "LABEL")))
    label = b"" if b"\n" in request.param else request.param
    trc = (folder / "written.trc").read_bytes().replace(b"LABEL", b"PSIS " + label)
    (folder / "written.trc").unlink()
    (folder / f"{name}.trc").write_bytes(trc)

    def solve(subject, settings, *, trials, reviews, extension=None, before_fitting=None, progress=None):
        (files,) = subject.trials
        read = small_fit.trials[0].capture
        capture = replace(read, name=files.name, files=(files.markers,), notes=subject.notes)
        return replace(
            small_fit,
            subject=subject,
            trials=(replace(small_fit.trials[0], capture=capture),),
            settings=as_dict(settings),
            provenance=provenance_of(subject, subject.trials, reviews, extension),
        )

    monkeypatch.setattr("addb_viewer.jobs.solving.solve", solve)
    return folder


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs a command as from a shell; it must succeed. What it prints."""

    def run(*words: object) -> str:
        monkeypatch.setattr("sys.argv", ["addb-viewer", *(os.fspath(word) for word in words)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        assert not ended.value.code, said.err
        return said.out

    return run


def test_a_fit_is_kept_exported_reported_flagged_and_found_again(named, run, tmp_path):
    (trial,) = open_subject(named).trials
    figures = tmp_path / "figures.json"
    run("fit", named, "--json", figures)
    run("flag", named, named.name.replace("\\", "_"), "1:3", "--reason", "other", "--author", "me")
    assert f"{trial.name}: " in run("flags", named, "--json", tmp_path / "flags.json")
    for form in ("csv", "parquet", "gltf", "c3d"):
        run("export", named, "--to", form, "--trial", trial.name)
    run("report", named)
    run("record", named, "--rrd", tmp_path / "x.rrd", "--mcap", tmp_path / "x.mcap")
    run("fit", named)  # with what was flagged
    run("init", named)
    (again,) = open_subject(named).trials
    assert (again.name, again.markers) == (trial.name, trial.markers)
    assert "unchanged" in run("fit", named)
    assert readable(named.name) in unescape((named / "results" / "report.html").read_text(encoding="utf-8"))
    for file in (figures, tmp_path / "flags.json", *named.rglob("*.json"), *named.rglob("*.toml")):
        text = file.read_text(encoding="utf-8")
        assert "\\udc" not in text
        if file.suffix == ".json":
            json.loads(text)
