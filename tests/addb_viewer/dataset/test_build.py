"""A release of two walks, judged from its files alone, and traps that must not be in it."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.dataset import build as building
from addb_viewer.dataset import subject_files
from addb_viewer.dataset.build import build, continuing, planned
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_subject import BuildOptions, Terms
from addb_viewer.dataset.release_tables import ROOT_TABLES, SUBJECT_TABLES
from addb_viewer.jobs.review_store import open_log
from annotations.events import FlagRange, SetActivity, SetStatus, Status
from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.subject.opened_subject import open_subject
from tests.addb_viewer.dataset.builds import ALL, TERMS, Here, planned_apart
from tests.addb_viewer.shell import run

GRAVITY = np.array([0.0, -9.80665, 0.0])


@pytest.fixture(scope="module")
def frames(release):
    """By subject, each column as floats; NaN where there is none."""

    def columns(name):
        table = pq.read_table(release / "frames" / f"Lab__{name}.parquet")
        numbers = [field.name for field in table.schema if "list" not in str(field.type)]
        texts = {
            "subject_id",
            "trial_id",
            "pass",
            "activity",
            "activity_sub",
            "activity_by",
            "missing_reason",
        }
        return {n: np.array(table[n].to_numpy(), float) for n in numbers if n not in texts}

    return {name: columns(name) for name in ("at_100", "at_200")}


def vectors(columns, pattern, axes="xyz"):
    return np.column_stack([columns[pattern.format(axis)] for axis in axes])


@pytest.mark.parametrize("name", ["at_100", "at_200"])
def test_a_foots_moment_is_that_of_its_pressure_and_its_free_moment(frames, name):
    columns, counts = frames[name], frames[name]["counts"] == 1
    moments, points = [], 0
    for side in "rl":
        force, foot = vectors(columns, f"grf_{side}_{{}}_N"), vectors(columns, f"foot_{side}_{{}}_m")
        moments.append(vectors(columns, f"grm_{side}_{{}}_Nm") + np.cross(foot, force))
        cop, free = vectors(columns, f"cop_{side}_{{}}_m"), columns[f"free_moment_{side}_Nm"]
        about_foot = np.cross(cop - foot, force) + np.column_stack([0 * free, free, 0 * free])
        np.testing.assert_allclose(
            about_foot, np.where(np.isnan(cop), np.nan, vectors(columns, f"grm_{side}_{{}}_Nm")), atol=2e-3
        )
        points += int(np.isfinite(cop[:, 0]).sum())
    assert np.isfinite(np.sum(moments, axis=0)[counts]).all()
    assert points > 30


@pytest.mark.parametrize("name", ["at_100", "at_200"])
def test_velocities_are_the_slopes_of_what_lies_beside_them(frames, name):
    columns, step = frames[name], 0.01
    for value, rate in (("q_knee_angle_r", "qd_knee_angle_r"), ("com_x_m", "com_v_x_m_s")):
        slope = (columns[value][2:] - columns[value][:-2]) / (2 * step)
        np.testing.assert_allclose(columns[rate][1:-1], slope, atol=0.15)
    slope = (columns["com_v_y_m_s"][2:] - columns["com_v_y_m_s"][:-2]) / (2 * step)
    assert np.abs(columns["com_a_y_m_s2"][1:-1] - slope).mean() < 0.5
    norm = np.linalg.norm(vectors(columns, "pelvis_q{}", "wxyz"), axis=1)
    np.testing.assert_allclose(norm, 1.0, atol=1e-6)


def test_both_recordings_of_one_walk_say_the_same(frames):
    one, other = frames["at_100"], frames["at_200"]
    assert (one["time_s"] == other["time_s"]).all()
    for name, most in (("q_hip_flexion_l", 0.02), ("com_x_m", 0.005), ("tau_ankle_angle_l", 10.0)):
        assert np.sqrt(np.mean((one[name] - other[name]) ** 2)) < most


def test_nothing_is_told_of_a_foot_that_does_not_count(frames):
    columns = frames["at_100"]
    silent = columns["counts_r"] == 0
    assert silent.any()
    for name in ("grf_r_x_N", "grm_r_y_Nm", "cop_r_z_m", "free_moment_r_Nm", "residual_force_x_N", "phase"):
        assert np.isnan(columns[name][silent]).all(), name
    assert (columns["torque_predicted"][silent] == 1).all()
    assert (columns["missing_number"] == 0).tolist() == (columns["counts"] == 1).tolist()
    assert (columns["contact_r"][silent] == 1).any()  # the step beside the plates


def test_tables_have_the_schema_and_the_rows_that_are_told(release):
    trials = pq.read_table(release / "trials.parquet").to_pylist()
    for table in (*ROOT_TABLES, *SUBJECT_TABLES):
        for path in sorted(release.glob(table.file("*"))):
            read = pq.read_table(path)
            assert read.schema.equals(table.schema(), check_metadata=True)
            read.validate(full=True)
            if table.of_subjects:
                for row in trials:
                    first, count = row[f"{table.name}_first_row"], row[f"{table.name}_rows"]
                    own = read.slice(first, count)["trial_id"].unique().to_pylist()
                    assert own == [row["trial_id"]] or row["subject_id"].split("/")[1] not in path.name


def test_the_b3d_file_has_the_numbers_of_the_tables(release, frames):
    b3d = read_b3d(release / "b3d" / "Lab__at_200.b3d")
    (trial,), columns = b3d.trials, frames["at_200"]
    assert [about.type for about in trial.header.processing_pass_header] == [0, 2, 1]
    assert (trial.header.original_name, trial.header.split_index) == ("walk", 0)
    assert np.array_equal(np.array(trial.sensors.custom_values)[:, 0], columns["counts"])
    kinematics = pq.read_table(release / "kinematics" / "Lab__at_200.parquet")
    first = np.array(trial.passes[0].pos)
    assert min(np.abs(first - kinematics["q_knee_angle_l"].to_numpy()[:, None]).max(axis=0)) < 1e-6
    assert b3d.header.subject_tag == ("Lab", "CC0-1.0")
    assert open_subject(release / "b3d" / "Lab__at_200.b3d").trials[0].name == "walk"


def test_no_file_tells_where_it_was_made(release, walks):
    for path in release.rglob("*"):
        if path.is_file() and path.name != "build_log.json":
            content = path.read_bytes()
            assert str(walks).encode() not in content, path
            assert f"{Path.home()}/".encode() not in content, path


def test_the_same_inputs_give_the_same_bytes_and_nothing_is_done_twice(release, walks, fitted, tmp_path):
    out = tmp_path / "release"
    engine = Here()
    build(planned_apart(walks), out, ALL, engine)
    for path in (release / "manifest.json", release / "croissant.json"):
        assert (out / path.name).read_bytes() == path.read_bytes()
    assert engine.did == ["Lab/at_200", "Lab/at_100"]  # the longer one first
    again = build(planned_apart(walks), out, ALL, engine)
    assert len(engine.did) == 2
    assert again["version"] == "1.0.0"
    other = BuildOptions(TERMS, unreviewed=True, without=("Lab/at_100",))
    less = build(planned([walks], other), out, other, engine)
    assert (less["version"], less["totals"]["subjects"]) == ("2.0.0", 1)
    assert less["previous"] == {"name": "release", "version": "1.0.0"}
    assert not list(out.glob("*/*at_100*"))
    assert len(engine.did) == 2
    (row,) = pq.read_table(out / "left_out.parquet").to_pylist()
    assert (row["id"], row["reason"]) == ("withdrawn", "withdrawn")


def test_who_withdrew_stays_out_of_later_builds_and_of_splits(walks, fitted, tmp_path):
    out, engine = tmp_path / "release", Here()
    build(planned_apart(walks), out, ALL, engine)
    assert run("dataset", "split", out, "--leave-one-person-out").exit_code == 0
    without = BuildOptions(TERMS, unreviewed=True, without=("Lab/at_100",))
    build(planned([walks], without), out, without, engine)
    again = build(planned_apart(walks), out, ALL, engine)
    assert again["totals"]["persons"] == 1
    assert continuing(ALL, out).leaves_out("Lab/at_100")
    everything = b"".join(p.read_bytes() for p in out.rglob("*") if p.is_file())
    assert b"at_100" not in everything
    assert [row["person_id"] for row in pq.read_table(out / "splits" / "default.parquet").to_pylist()] == [
        "Lab/at_200"
    ]
    dry = ["dataset", "build", *map(str, sorted(walks.iterdir())), "--out", str(out), "--dry-run"]
    told = run(*dry, "--unreviewed", "--licence", "CC0-1.0", "--consent", "public")
    assert told.exit_code == 0, told.output


def test_a_recording_that_no_trial_names_is_told(walks, tmp_path):
    folder = tmp_path / "root" / "at_100"
    shutil.copytree(walks / "at_100", folder)
    (trial,) = open_subject(folder).trials
    marker, force = trial.markers.relative_to(folder), trial.forces.relative_to(folder)
    text = f'mass_kg = 71\n[trials.walk]\nmarkers = "{marker}"\nforces = "{force}"\n'
    (folder / "subject.toml").write_text(text, encoding="utf-8")
    (folder / "extra").mkdir()
    shutil.copy(trial.markers, folder / "extra" / "markers.trc")
    (row,) = planned([folder], ALL).left_out
    assert (row.level, row.reason, row.id) == ("trial", "not_listed", "Lab/at_100/extra/markers")


def test_a_licence_is_an_spdx_expression(walks, tmp_path):
    for licence, kept in (("own", False), ("https://lab.org/terms", False), ("LicenseRef-lab", True)):
        plan = planned([walks / "at_100"], BuildOptions(Terms("Lab", licence, "public"), unreviewed=True))
        assert bool(plan.wanted) == kept
        assert kept or "SPDX" in plan.left_out[0].detail
    command = ["dataset", "build", str(walks), "--out", str(tmp_path / "out"), "--licence", "own"]
    assert CliRunner().invoke(app, command).exit_code == 2


def test_a_release_can_do_without_b3d(walks, fitted, tmp_path):
    options, out = BuildOptions(TERMS, unreviewed=True, b3d=False), tmp_path / "release"
    build(planned([walks / "at_100"], options), out, options, Here())
    assert not (out / "b3d").exists()
    assert (out / "frames" / "Lab__at_100.parquet").is_file()
    assert (out / "models" / "Lab__at_100.unfitted.osim").is_file() == (
        open_subject(walks / "at_100").mass_kg is not None
    )
    (trial,) = pq.read_table(out / "trials.parquet").to_pylist()
    assert isinstance(trial["concerns"], list)


def test_reviews_labels_and_erroneous_stretches(walks, fitted, tmp_path):
    """The fit stays the one without the review, which is enough for what is judged here."""
    root = tmp_path / "root"
    shutil.copytree(walks / "at_100", root / "at_100")
    options = BuildOptions(TERMS)
    assert [row.reason for row in planned([root], options).left_out] == ["not_reviewed", "no_trials"]
    with open_log(root / "at_100") as log:
        log.append("walk", SetActivity(0, 90, "walk", "overground"), "anna.meier")
        log.append("walk", FlagRange(3, 9, "notOverForcePlate"), "anna.meier")
        log.append("walk", SetStatus(Status.FINISHED), "bert")
    out = tmp_path / "release"
    build(planned([root], options), out, options, Here())
    (trial,) = pq.read_table(out / "trials.parquet").to_pylist()
    assert (trial["activity"], trial["activity_sub"], trial["trial_type"]) == (
        "walk",
        "overground",
        "overground",
    )
    assert trial["reviewed"]
    assert trial["average_speed_m_s"] == pytest.approx(1.3, rel=0.04)  # as simulated
    (segment,) = pq.read_table(out / "segments.parquet").to_pylist()
    assert (segment["average_speed_m_s"], segment["speed_kind"]) == (trial["average_speed_m_s"], "overground")
    row, *others = pq.read_table(out / "activities.parquet").to_pylist()
    assert (row["start_frame"], row["end_frame"], row["reviewer"]) == (0, 90, "reviewer_1")
    assert (trial["activity_by"], trial["activity_confidence"]) == ("person", None)
    assert all(one["start_frame"] >= 90 and one["reviewer"] is None for one in others)
    frames = pq.read_table(out / "frames" / "Lab__at_100.parquet").to_pylist()
    undecided = [row["missing_reason"] is not None and not row["detected_ok"] for row in frames]
    assert [row["reviewed"] for row in frames] == [not one for one in undecided]
    assert any(undecided)  # the step that detection left out before anybody had fitted
    b3d = read_b3d(out / "b3d" / "Lab__at_100.b3d").trials[0].header
    assert b3d.has_manual_GRF_annotation.tolist() == [row["reviewed"] for row in frames]
    labels = pq.read_table(out / "frames" / "Lab__at_100.parquet")["activity_by"].to_pylist()
    assert labels[:90] == ["person"] * 90
    assert "person" not in labels[90:]


def test_what_nobody_has_labelled_is_as_rules_suggest_and_says_how_sure(release):
    trials = pq.read_table(release / "trials.parquet").to_pylist()
    assert [(t["activity"], t["activity_sub"], t["activity_by"]) for t in trials] == [
        ("walk", "overground", "rule")
    ] * 2
    assert all(0.6 <= t["activity_confidence"] <= 1.0 for t in trials)
    told = pq.read_table(release / "activities.parquet").to_pylist()
    assert [(row["reviewer"], row["activity_by"]) for row in told] == [(None, "rule")] * len(told)
    for trial in trials:
        assert trial["average_speed_m_s"] == pytest.approx(1.3, rel=0.04)


def test_nobodys_name_is_in_a_release(walks, fitted, tmp_path):
    root, out = tmp_path / "root", tmp_path / "release"
    shutil.copytree(walks / "at_100", root / "at_100")
    with open_log(root / "at_100") as log:
        log.append("walk", SetActivity(0, 90, "walk", "overground"), "anna.meier")
        log.append("walk", SetStatus(Status.FINISHED), "bert")
    build(planned([root], BuildOptions(TERMS)), out, BuildOptions(TERMS), Here())
    everything = b"".join(p.read_bytes() for p in out.rglob("*") if p.is_file())
    assert b"anna" not in everything
    assert b"bert" not in everything


def test_reviewers_keep_their_names_where_that_is_asked(walks, fitted, tmp_path):
    root, out = tmp_path / "root", tmp_path / "release"
    shutil.copytree(walks / "at_100", root / "at_100")
    with open_log(root / "at_100") as log:
        log.append("walk", SetActivity(0, 90, "walk", "overground"), "anna.meier")
    options = BuildOptions(TERMS, unreviewed=True, names=True)
    build(planned([root], options), out, options, Here())
    told = pq.read_table(out / "activities.parquet")["reviewer"].to_pylist()
    assert told[0] == "anna.meier"


def test_every_trap_ends_in_what_is_left_out(walks, tmp_path):
    root = tmp_path / "root"

    def trap(name, release='[release]\nlicence = "CC0-1.0"\nconsent = "public"\n', person="mass_kg = 71\n"):
        shutil.copytree(walks / "at_100", root / name)
        text = f'{person}{release}[trials.walk]\nmarkers = "{marker}"\nforces = "{force}"\n'
        (root / name / "subject.toml").write_text(text, encoding="utf-8")
        return root / name

    files = sorted((walks / "at_100").rglob("*.*"))
    marker, force = (
        next(p.relative_to(walks / "at_100").as_posix() for p in files if p.suffix == suffix)
        for suffix in (".trc", ".mot")
    )
    trap("a_good_one")
    trap("b_no_licence", '[release]\nconsent = "public"\n')
    trap("c_not_public", '[release]\nlicence = "CC0-1.0"\nconsent = "restricted"\n')
    trap("d_three_feet", person='foot_bodies = ["calcn_r", "calcn_l", "hand_r"]\n')
    trap("e_copy")
    broken = trap("f_broken")
    (broken / marker).write_text("nonsense", encoding="utf-8")
    no_forces = trap("g_no_forces")
    text = (no_forces / "subject.toml").read_text(encoding="utf-8").split("forces")[0]
    (no_forces / "subject.toml").write_text(text, encoding="utf-8")
    (no_forces / force).unlink()
    options = BuildOptions(Terms("Lab"), unreviewed=True)
    plan = planned([root], options)
    assert [one.who.folder for one in plan.wanted] == ["a_good_one"]
    told = {(row.id, row.reason) for row in plan.left_out}
    assert told == {
        ("Lab/b_no_licence", "no_licence"),
        ("Lab/c_not_public", "no_consent"),
        ("Lab/d_three_feet", "not_two_contact_bodies"),
        ("Lab/e_copy", "duplicate_subject"),
        ("Lab/f_broken/walk", "unreadable"),
        ("Lab/f_broken", "no_trials"),
        ("Lab/g_no_forces/walk", "no_forces"),
        ("Lab/g_no_forces", "no_trials"),
    }
    (copy,) = [row for row in plan.left_out if row.reason == "duplicate_subject"]
    assert (copy.detail, copy.frames) == ("same as Lab/a_good_one; they are called two persons", 121)
    assert copy.hours == pytest.approx(121 / 100 / 3600)


def test_of_one_recording_at_two_rates_the_faster_one_is_taken(walks):
    plan = planned([walks], ALL)
    assert [one.who.folder for one in plan.wanted] == ["at_200"]
    (row,) = plan.left_out
    assert (row.id, row.reason) == ("Lab/at_100", "duplicate_subject")
    assert row.detail == "same as Lab/at_200; it has more frames a second; they are called two persons"


def test_a_part_of_another_trial_is_left_out_and_the_whole_one_stays(walks, tmp_path):
    """The part is the one that comes first by name, and was recorded faster."""
    root = tmp_path / "root"
    shutil.copytree(walks / "at_200", root / "a_part")
    shutil.copytree(walks / "at_100", root / "whole")
    (trc,) = (root / "a_part").rglob("*.trc")
    markers = read_trc(trc).markers
    write_trc(trc, replace(markers, positions_ground=markers.positions_ground[20:-10]))
    plan = planned([root], ALL)
    assert [one.who.folder for one in plan.wanted] == ["whole"]
    (row,) = plan.left_out
    assert row.detail == "same as Lab/whole; it is longer; they are called two persons"


def test_a_failing_fit_ends_in_what_is_left_out_and_takes_no_other_with_it(walks, fitted, fit_100, tmp_path):
    def failing(subject, *_, **__):
        if subject.name == "at_200":
            raise ReleaseError(f"{subject.folder}/trials/walk.trc: its skeleton cannot be told")
        return fit_100

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(subject_files, "solve", failing)
        build(planned_apart(walks), tmp_path / "release", ALL, Here())
    (row,) = pq.read_table(tmp_path / "release" / "left_out.parquet").to_pylist()
    assert (row["id"], row["reason"], row["detail"]) == (
        "Lab/at_200",
        "fit_failed",
        "trials/walk.trc: its skeleton cannot be told",
    )
    assert len(list((tmp_path / "release").glob("*/*at_200*"))) == 0


def test_what_cannot_be_built_is_said_before_anything_is_written(walks, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(walks / "at_100", other / "at_100")
    with pytest.raises(ReleaseError, match=r"two subjects are called Lab/at_100: .*Rename one folder"):
        planned([walks, other], ALL)
    with pytest.raises(ReleaseError, match=r"--without Lab/nobody: nobody is called that"):
        planned([walks], BuildOptions(TERMS, unreviewed=True, without=("Lab/nobody",)))
    plan = planned([walks], ALL)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.doc").touch()
    with pytest.raises(ReleaseError, match="holds something else than a release"):
        build(plan, tmp_path / "mine", ALL, Here())
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "manifest.json").write_text('{"format_version": 0}', encoding="utf-8")
    with pytest.raises(ReleaseError, match=r"has format 0, this version reads 1\. Build it anew"):
        build(plan, tmp_path / "old", ALL, Here())
    silent = BuildOptions(Terms("Lab"))
    with pytest.raises(ReleaseError, match=r"nothing is left to release \(no_licence\)"):
        build(planned([walks], silent), tmp_path / "none", silent, Here())
    assert not (tmp_path / "none").exists()


def test_a_full_disk_leaves_the_release_before_whole(walks, fitted, small_disk, tmp_path):
    root, out = tmp_path / "root", small_disk.folder / "release"
    shutil.copytree(walks / "at_100", root / "at_100")
    build(planned([root], ALL), out, ALL, Here())
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    other = BuildOptions(Terms("Lab", "CC-BY-4.0", "public"), unreviewed=True)
    small_disk.fill()
    said = r"\d\.\d MB are free, the release needs about \d\.\d MB\. Make room"
    with pytest.raises(ReleaseError, match=said):
        build(planned([root], other), out, other, Here())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(building, "BYTES_PER_FRAME", 0)
        with pytest.raises(ReleaseError, match=r"(?i)no space left|full"):
            build(planned([root], other), out, other, Here())
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_a_folder_that_cannot_be_written_to_is_said_at_once(walks, fitted, read_only, tmp_path):
    (tmp_path / "place").mkdir()
    place = read_only(tmp_path / "place")
    engine = Here()
    with pytest.raises(ReleaseError, match=r"(?i)read-only|not be written|cannot be written"):
        build(planned_apart(walks), place / "release", ALL, engine)
    assert not engine.did


def test_an_unloaded_foot_has_a_force_of_exactly_zero(frames):
    for columns in frames.values():
        for side in "rl":
            force = np.linalg.norm(vectors(columns, f"grf_{side}_{{}}_N"), axis=1)
            assert (force == 0).any()
            assert not ((force > 0) & (force < 1e-3)).any()
