"""A fit on disk: whole, read back exactly, or refused."""

import json
import subprocess
import sys
import textwrap
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from solver.common.errors import ResultsError
from solver.dynamics.cross_validation.held_out import HeldOutBlocks, HeldOutLayout
from solver.fitting.results.store import FORMAT, default_folder, has_fit, load_fit, save_fit
from solver.fitting.settings import Settings, as_dict
from solver.kinematics.motion import Motion


def assert_same(first, second, place="fit"):
    assert type(first) is type(second), place
    if isinstance(first, np.ndarray):
        assert first.dtype == second.dtype, place
        np.testing.assert_array_equal(first, second, err_msg=place)
    elif is_dataclass(first):
        for f in fields(first):
            assert_same(getattr(first, f.name), getattr(second, f.name), f"{place}.{f.name}")
    elif isinstance(first, tuple):
        assert len(first) == len(second), place
        for i, pair in enumerate(zip(first, second, strict=True)):
            assert_same(*pair, f"{place}[{i}]")
    else:
        assert first == second, place


@pytest.fixture
def folder(small_fit):
    return default_folder(small_fit.subject.folder)


def test_a_fit_comes_back_as_it_was(small_fit, folder):
    save_fit(small_fit, folder)
    assert_same(load_fit(folder, small_fit.subject.folder), small_fit)


def test_layouts_of_held_out_forces_come_back_and_an_older_fit_has_none(small_fit, folder):
    squares = np.array([[1.5, 2.0], [0.25, 1.0]])
    blocks = HeldOutBlocks(np.array([[0, 2], [3, 4]]), np.array([2, 1]), squares, 2 * squares, (6.0, 8.0))
    layouts = (HeldOutLayout("blocks", 0, {"walk": blocks}), HeldOutLayout("steps", 0))
    save_fit(replace(small_fit, held_out_layouts=layouts), folder)
    one, other = load_fit(folder, small_fit.subject.folder).held_out_layouts
    assert_same(one.trials["walk"], blocks)
    assert_same(other, layouts[1])
    head = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    assert head["trials"][0]["held_out_layouts"]["blocks"]["pieces"] == 2
    assert head["trials"][1]["held_out_layouts"] == {"blocks": None, "steps": None}  # without forces
    file = folder / head["solve"] / "subject.json"
    about = json.loads(file.read_text(encoding="utf-8"))
    del about["held_out_layouts"], head["sha256"]
    file.write_text(json.dumps(about), encoding="utf-8")
    (folder / "fit.json").write_text(json.dumps(head), encoding="utf-8")
    assert load_fit(folder, small_fit.subject.folder).held_out_layouts == ()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25, deadline=None)
@given(st.data())
def test_any_motion_comes_back_bit_by_bit(small_fit, folder, data):
    q = data.draw(arrays(np.float64, (5, 2), elements=st.floats(allow_nan=True, allow_infinity=True)))
    rate = data.draw(st.floats(1e-3, 1e6))
    trial = replace(small_fit.trials[0], motion=Motion(("a", "b"), q=q, rate=rate))
    fit = replace(small_fit, trials=(trial,))
    save_fit(fit, folder)
    back = load_fit(folder, small_fit.subject.folder).trials[0].motion
    assert back.q.tobytes() == q.tobytes()
    assert back.rate == rate


def test_what_lies_in_the_folder(small_fit, folder):
    written = save_fit(small_fit, folder)
    names = ["fit.json", "solve-1/skeleton.json", "solve-1/subject.json"]
    names += ["solve-1/trials/walk.npz", "solve-1/trials/no%2fforces.npz"]
    assert [path.relative_to(folder).as_posix() for path in written] == names
    assert sorted(path for path in folder.rglob("*") if path.is_file()) == sorted(written)
    figures = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    assert figures["files"] == names
    assert figures["trials"][0]["frames"] == 4


def test_arrays_are_readable_by_name_without_this_program(small_fit, folder):
    save_fit(small_fit, folder)
    with np.load(folder / "solve-1" / "trials" / "walk.npz", allow_pickle=False) as stored:
        np.testing.assert_array_equal(stored["motion.q"], small_fit.trials[0].motion.q)
        np.testing.assert_array_equal(stored["dynamics.used"], [True, False, True, True])


def test_a_second_fit_takes_the_place_of_the_first_and_of_nothing_else(small_fit, folder):
    save_fit(small_fit, folder)
    (folder / "opensim").mkdir()
    (folder / "my notes.txt").write_text("keep")
    second = replace(small_fit, trials=small_fit.trials[:1], mass_kg=90.0)
    save_fit(second, folder)
    assert load_fit(folder, small_fit.subject.folder).mass_kg == 90.0
    assert sorted(path.name for path in folder.iterdir()) == [
        "fit.json",
        "my notes.txt",
        "opensim",
        "solve-2",
    ]


def test_the_subject_may_move_house(small_fit, folder, tmp_path):
    save_fit(small_fit, folder)
    elsewhere = tmp_path / "elsewhere"
    small_fit.subject.folder.rename(elsewhere)
    back = load_fit(elsewhere / "results", elsewhere)
    assert back.subject.folder == elsewhere
    assert back.trials[0].capture.files == (elsewhere / "trials" / "walk" / "markers.trc",)


def test_a_failure_half_way_leaves_the_previous_fit_and_no_debris(small_fit, folder, monkeypatch):
    save_fit(small_fit, folder)
    before = sorted(folder.rglob("*"))
    monkeypatch.setattr("solver.fitting.results.store._write_trial", _fail_on_second_call())
    with pytest.raises(KeyboardInterrupt):
        save_fit(replace(small_fit, mass_kg=1.0), folder)
    assert sorted(folder.rglob("*")) == before
    assert load_fit(folder, small_fit.subject.folder).mass_kg == 100.0


def test_a_failure_of_the_first_fit_leaves_no_folder(small_fit, folder, monkeypatch):
    monkeypatch.setattr("solver.fitting.results.store._write_trial", _fail_on_second_call())
    with pytest.raises(KeyboardInterrupt):
        save_fit(small_fit, folder)
    assert not small_fit.subject.folder.exists()


def _fail_on_second_call():
    calls = []

    def write(_trial, path, _base):
        calls.append(path)
        path.write_bytes(b"half")
        if len(calls) == 2:
            raise KeyboardInterrupt

    return write


@pytest.mark.parametrize("killed_in", ["_write_trial", "write_json", "_remove_other_solves"])
def test_a_killed_run_leaves_a_whole_fit(small_fit, folder, killed_in):
    save_fit(small_fit, folder)
    script = f"""
        import os
        from dataclasses import replace
        from pathlib import Path
        from solver.fitting.results import store
        subject = Path({str(small_fit.subject.folder)!r})
        fit = replace(store.load_fit(subject / "results", subject), mass_kg=50.0)
        store.{killed_in} = lambda *_: os._exit(9)
        store.save_fit(fit, subject / "results")
    """
    killed = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=False)
    assert killed.returncode == 9
    committed = killed_in == "_remove_other_solves"
    assert load_fit(folder, small_fit.subject.folder).mass_kg == (50.0 if committed else 100.0)
    save_fit(replace(small_fit, mass_kg=70.0), folder)
    assert load_fit(folder, small_fit.subject.folder).mass_kg == 70.0
    assert len(list(folder.glob("solve-*"))) == 1


@pytest.mark.parametrize(
    "name", ["fit.json", "solve-1/skeleton.json", "solve-1/subject.json", "solve-1/trials/walk.npz"]
)
@pytest.mark.parametrize("kept", [0, 0.5, None])
def test_half_a_fit_is_refused_by_the_name_of_the_file(small_fit, folder, name, kept):
    save_fit(small_fit, folder)
    path = folder / name
    content = path.read_bytes()
    path.unlink()
    if kept is not None:
        path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(ResultsError, match=path.name):
        load_fit(folder, small_fit.subject.folder)


def test_another_format_is_refused_with_both_numbers(small_fit, folder):
    save_fit(small_fit, folder)
    head = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    (folder / "fit.json").write_text(json.dumps(head | {"format": FORMAT + 6}))
    with pytest.raises(ResultsError, match=rf"format {FORMAT + 6}.*reads {FORMAT}.*addb-viewer fit"):
        load_fit(folder, small_fit.subject.folder)


def unchecked(folder):
    """Of a version that kept no digests, or by who took them out."""
    head = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    del head["sha256"]
    (folder / "fit.json").write_text(json.dumps(head), encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("skeleton.json", "0.1", "null"),
        ("skeleton.json", '"hip"', '"hop"'),
        ("skeleton.json", "{", "{ "),
        ("subject.json", "100.0", "101.0"),
        ("subject.json", "98.5", "null"),
    ],
)
def test_json_that_was_changed_is_refused_whatever_it_says(small_fit, folder, name, old, new):
    save_fit(small_fit, folder)
    path = folder / "solve-1" / name
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ResultsError, match=rf"{name}: cannot be read \(it is damaged.*addb-viewer fit"):
        load_fit(folder, small_fit.subject.folder)


@pytest.mark.parametrize(
    ("old", "new"), [('"Skeleton"', '"Popen"'), ('"gravity"', '"levity"'), ('"fields"', '"members"')]
)
def test_types_and_fields_of_others_are_refused(small_fit, folder, old, new):
    save_fit(small_fit, folder)
    path = folder / "solve-1" / "skeleton.json"
    path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    unchecked(folder)
    with pytest.raises(ResultsError, match=r"skeleton\.json.*not written by this version"):
        load_fit(folder, small_fit.subject.folder)


def test_no_fit_is_no_fit(tmp_path):
    assert not has_fit(tmp_path)
    with pytest.raises(ResultsError, match=r"fit\.json: missing.*addb-viewer fit"):
        load_fit(tmp_path, tmp_path)


def moved_out(folder):
    """The folder of the fit's arrays, moved to where nobody opened anything."""
    (solve,) = folder.glob("solve-*")
    outside = folder.parent.parent / "outside"
    solve.rename(outside)
    return solve, outside


@pytest.mark.parametrize("told", ["../../outside", "absolute", "solve-1/../../../outside", None, ["solve-1"]])
def test_a_fit_that_names_a_folder_elsewhere_is_not_followed(small_fit, folder, told):
    save_fit(small_fit, folder)
    _, outside = moved_out(folder)
    head = json.loads((folder / "fit.json").read_text())
    head["solve"] = str(outside) if told == "absolute" else told
    (folder / "fit.json").write_text(json.dumps(head))
    with pytest.raises(ResultsError, match=r"fit\.json.*names"):
        load_fit(folder, small_fit.subject.folder)


def test_a_link_to_a_fit_elsewhere_is_not_followed(small_fit, folder):
    save_fit(small_fit, folder)
    solve, outside = moved_out(folder)
    solve.symlink_to(outside)
    with pytest.raises(ResultsError, match=r"fit\.json.*names.*outside"):
        load_fit(folder, small_fit.subject.folder)


def test_a_trial_elsewhere_is_not_followed(small_fit, folder):
    save_fit(small_fit, folder)
    (solve,) = folder.glob("solve-*")
    (solve / "trials" / "walk.npz").rename(folder.parent / "walk.npz")
    about = json.loads((solve / "subject.json").read_text())
    about["trials"][0] = "../../walk.npz"
    (solve / "subject.json").write_text(json.dumps(about))
    unchecked(folder)
    with pytest.raises(ResultsError, match=r"subject\.json.*names.*walk\.npz"):
        load_fit(folder, small_fit.subject.folder)


def test_a_results_folder_may_be_a_link_that_the_user_made(small_fit, folder, tmp_path):
    save_fit(small_fit, tmp_path / "large disk")
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.symlink_to(tmp_path / "large disk")
    assert load_fit(folder, small_fit.subject.folder).mass_kg == 100.0


def test_settings_come_back_as_they_were_kept(small_fit, folder):
    """Lists in lists, too, as what JSON gives back."""
    kept = as_dict(Settings())
    save_fit(replace(small_fit, settings=kept), folder)
    assert load_fit(folder, small_fit.subject.folder).settings == kept
