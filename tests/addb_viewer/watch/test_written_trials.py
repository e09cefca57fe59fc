"""When a trial counts as written: its files rest, belong together, and hold what they say."""

import hashlib

import pytest

from addb_viewer.watch.written_trials import CUT_S, TOLD_S, WatchedSubject, is_cut, of_former, subjects_below


class Looking:
    """A subject looked at every quarter of a second."""

    def __init__(self, folder):
        self.subject, self.now = WatchedSubject(folder), 0.0

    def after(self, seconds):
        found = []
        for _ in range(round(4 * seconds)):
            self.now += 0.25
            found += self.subject.written(self.now)
        return [trial.name for trial in found]


@pytest.fixture
def looking(tmp_path):
    folder = tmp_path / "S01"
    folder.mkdir()
    return Looking(folder)


def test_files_that_come_byte_by_byte_are_waited_for(looking, recording):
    markers, forces = recording()
    found = []
    for name, data in (("walk.trc", markers), ("walk_grf.mot", forces)):
        for share in range(1, 21):
            (looking.subject.folder / name).write_bytes(data[: share * len(data) // 20 + 1])
            found += looking.after(0.5)
    assert found == []
    assert looking.after(0.25) == []
    assert looking.after(1) == ["walk"]
    assert looking.after(30) == []
    assert looking.subject.trouble == ""


def test_a_pause_amid_a_file_is_waited_for_and_a_wrong_head_is_not_for_ever(looking, recording):
    markers, forces = recording()
    (looking.subject.folder / "walk_grf.mot").write_bytes(forces)
    cut = markers[: markers.rindex(b"\n", 0, len(markers) // 2) + 1]
    (looking.subject.folder / "walk.trc").write_bytes(cut)
    assert looking.after(14) == []
    assert looking.after(12) == ["walk"]  # it has rested for twenty seconds: it is what it is
    (looking.subject.folder / "walk.trc").write_bytes(markers)
    assert looking.after(2) == ["walk"]


def test_markers_wait_for_forces_and_do_without_in_the_end(looking, recording):
    (looking.subject.folder / "gait.trc").write_bytes(recording(1)[0])
    assert looking.after(3) == []
    assert looking.after(3) == ["gait"]
    markers, forces = recording()
    (looking.subject.folder / "walk.trc").write_bytes(markers)
    assert looking.after(3) == []
    (looking.subject.folder / "walk_grf.mot").write_bytes(forces)
    assert looking.after(2) == ["walk"]
    (looking.subject.folder / "run.trc").write_bytes(recording(2)[0])  # others have forces
    assert looking.after(14) == []
    assert looking.after(12) == ["run"]


def test_a_finished_trial_does_not_wait_for_the_next(looking, put, recording):
    put(looking.subject.folder, "walk")
    found = []
    for share in range(1, 10):
        (looking.subject.folder / "run.trc").write_bytes(recording(1)[0][: 1000 + 200 * share])
        found += looking.after(0.5)
    assert found == ["walk"]


def test_a_replaced_file_is_handed_out_again(looking, put):
    put(looking.subject.folder, "walk")
    [first] = [t for k in range(8) for t in looking.subject.written(0.25 * k)]
    assert looking.subject.is_current(first)
    put(looking.subject.folder, "walk", 1)
    [second] = [t for k in range(20) for t in looking.subject.written(10 + 0.25 * k)]
    assert second.digest != first.digest
    assert not looking.subject.is_current(first)


def test_a_replaced_file_waits_for_the_other_of_its_pair(looking, put, recording):
    put(looking.subject.folder, "walk")
    assert looking.after(2) == ["walk"]
    markers, forces = recording(1)
    (looking.subject.folder / "walk.trc").write_bytes(markers)
    assert looking.after(0.7 * CUT_S) == []
    (looking.subject.folder / "walk_grf.mot").write_bytes(forces)
    assert looking.after(2) == ["walk"]
    (looking.subject.folder / "walk_grf.mot").write_bytes(recording(2)[1])
    assert looking.after(0.7 * CUT_S) == []
    assert looking.after(0.4 * CUT_S) == ["walk"]  # it was exported anew, perhaps; whoever judges it knows


def test_which_files_are_of_a_former_recording_also_after_a_restart(looking, put, recording):
    put(looking.subject.folder, "walk", 1)
    old = recording(0)
    digests = {"walk": [tuple(hashlib.sha256(data).hexdigest() for data in (old[0], recording(1)[1]))]}
    anew = WatchedSubject(looking.subject.folder, digests)
    assert [t for k in range(8) for t in anew.written(0.25 * k)] == []
    [trial] = [t for k in range(8, 100) for t in anew.written(0.25 * k)]
    assert [file.name for file in trial.kept] == ["walk_grf.mot"]


@pytest.mark.parametrize(
    ("files", "former", "of_the_former"),
    [
        ("B a", ["A a"], [False, True]),
        ("A b", ["A a"], [True, False]),
        ("B b", ["A a"], []),
        ("B b", ["A a", "B a"], []),  # the second was mixed itself
        ("B a", ["A a", "B a"], [False, True]),
        ("A a", ["A a", "B b"], []),  # the first one, put back
        ("A a", ["A"], []),  # its forces came late
        ("B b", ["A"], []),
    ],
)
def test_what_is_of_a_former_recording(files, former, of_the_former):
    assert list(of_former(tuple(files.split()), [tuple(f.split()) for f in former])) == of_the_former


def test_files_that_are_named_and_not_there_are_waited_for_and_told_once(looking, put, recording):
    folder = looking.subject.folder
    trials = "".join(
        f'[trials.{name}]\nmarkers = "../{name}.trc"\nforces = "{name}_grf.mot"\n' for name in ("walk", "run")
    )
    (folder / "subject.toml").write_text(
        f'model = "scaled.osim"\nstatic = "static.trc"\n{trials}[release]\ncitation = "ours.bib"\n'
    )
    markers, forces = recording()
    (folder / "walk_grf.mot").write_bytes(forces)
    (folder.parent / "walk.trc").write_bytes(markers)
    assert looking.after(0.8 * TOLD_S) == ["walk"]
    assert (looking.subject.trouble, looking.subject.missing(looking.now)) == ("", [])
    told = looking.subject.missing(looking.now + TOLD_S)
    assert {p.name for p in told} == {"scaled.osim", "static.trc", "run.trc", "run_grf.mot", "ours.bib"}
    assert looking.subject.missing(looking.now + 9 * TOLD_S) == []
    (folder.parent / "run.trc").write_bytes(recording(1)[0])
    assert looking.after(0.7 * CUT_S) == []
    (folder / "run_grf.mot").write_bytes(recording(1)[1])
    assert looking.after(2) == ["run"]


def test_static_trials_are_taken_as_such(looking, put, recording):
    (looking.subject.folder / "static.trc").write_bytes(recording(moving=0.0)[0])
    now = [trial for k in range(8) for trial in looking.subject.written(0.25 * k)]
    assert [(trial.name, trial.static) for trial in now] == [("static", True)]
    put(looking.subject.folder, "walk")
    later = [trial for k in range(8) for trial in looking.subject.written(9 + 0.25 * k)]
    assert [(trial.name, trial.static) for trial in later] == [("walk", False)]


@pytest.mark.parametrize(
    ("name", "head", "row"),
    [
        ("a.mot", "x\nnRows=3\nendheader\ntime\ta\n", "0.1\t2\n"),
        ("a.tsv", "NO_OF_FRAMES\t3\nMARKER_NAMES\ta\n", "1.0\t2.0\t3.0\n"),
        ("a.trc", "DataRate\tCameraRate\tNumFrames\n100\t100\t3\nFrame#\n", " 1\t0.0\t2\n"),
    ],
)
def test_a_file_says_how_many_rows_it_has(tmp_path, name, head, row):
    (tmp_path / name).write_text(head + 2 * row)
    assert is_cut(tmp_path / name)
    (tmp_path / name).write_text(head + 3 * row)
    assert not is_cut(tmp_path / name)


def test_the_watched_folder_is_a_subject_or_holds_subjects(tmp_path, put):
    assert subjects_below(tmp_path) == []
    put(tmp_path / "S01", "walk")
    (tmp_path / "notes").mkdir()
    assert subjects_below(tmp_path) == [tmp_path / "S01"]
    assert subjects_below(tmp_path / "S01") == [tmp_path / "S01"]


@pytest.mark.real
def test_a_c3d_file_is_waited_for_until_it_reads_whole(tmp_path, real_data):
    whole = next((real_data / "c3d_lab_trials" / "lasem_FAILT01").glob("*.c3d")).read_bytes()
    looking = Looking(tmp_path)
    (tmp_path / "walk.c3d").write_bytes(whole[: len(whole) // 2])
    assert looking.after(4) == []
    (tmp_path / "walk.c3d").write_bytes(whole)
    assert looking.after(2) == ["walk"]
