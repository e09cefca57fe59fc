"""A built release passes every check, and one that is spoiled in some way fails that check alone."""

import json
import shutil

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from addb_viewer.dataset.build import build, planned
from addb_viewer.dataset.check.checking import checked
from tests.addb_viewer.dataset.builds import ALL, Here
from tests.addb_viewer.shell import run

FRAMES = "frames/Lab__at_100.parquet"
TRIAL = "Lab/at_100/walk"


@pytest.fixture(scope="module")
def one_walk(walks, instead_of_solving, tmp_path_factory):
    """A release of one walk."""
    root, out = tmp_path_factory.mktemp("in"), tmp_path_factory.mktemp("out") / "release"
    shutil.copytree(walks / "at_100", root / "at_100")
    with instead_of_solving():
        build(planned([root], ALL), out, ALL, Here())
    return out


@pytest.fixture
def spoiled(one_walk, tmp_path):
    """A copy to spoil."""
    folder = tmp_path / "spoiled"
    shutil.copytree(one_walk, folder)
    return folder


def change(folder, path, **columns):
    """Columns of a table by a function of their values."""
    table = pq.read_table(folder / path)
    for name, new in columns.items():
        at, field = table.column_names.index(name), table.schema.field(name)
        table = table.set_column(at, field, pa.array(new(table[name].to_pylist()), field.type))
    pq.write_table(table, folder / path)


def one_more(row, by):
    """Adds to one value of a column."""
    return lambda values: [v + by if k == row and v is not None else v for k, v in enumerate(values)]


def first_counted(folder):
    return pq.read_table(folder / FRAMES)["counts"].to_pylist().index(True)


def test_one_walk_recorded_at_two_rates_is_one_recording_and_nothing_else_is_wrong(release):
    (one,) = checked(release)
    assert (one.level.value, one.check, one.where) == ("error", "duplicates", TRIAL)
    assert "Lab/at_200/walk" in one.said


def test_what_was_built_passes(one_walk):
    assert checked(one_walk) == []
    result = run("dataset", "check", one_walk)
    assert result.exit_code == 0
    assert result.output == "0 errors, 0 warnings\n"


def test_a_changed_a_missing_and_a_strange_file_are_told(spoiled, tmp_path):
    (spoiled / "README.md").write_text("other")
    (spoiled / "LICENCES.md").unlink()
    (spoiled / "notes.txt").write_text("mine")
    said = {(one.where, one.level.value) for one in checked(spoiled)}
    assert said == {("README.md", "error"), ("LICENCES.md", "error"), ("notes.txt", "warning")}
    out = tmp_path / "found.json"
    result = run("dataset", "check", spoiled, "--json", out)
    assert result.exit_code == 1
    told = json.loads(out.read_text())
    assert told["errors"] == 2
    assert {finding["check"] for finding in told["findings"]} == {"files"}


@pytest.mark.parametrize(
    ("column", "by", "checks", "said"),
    [
        ("grf_r_x_N", 5.0, {"forces", "torques", "b3d"}, "F = ma does not hold on 1 frames"),
        ("grm_r_x_Nm", 3.0, {"forces", "torques"}, "the residual moment is another on 1 frames"),
        ("residual_moment_z_Nm", 1.0, {"forces"}, "the residual moment is another on 1 frames"),
        ("residual_force_y_N", 1.0, {"forces"}, "F = ma does not hold on 1 frames"),
        ("tau_knee_angle_r", 0.5, {"torques"}, "most in knee_angle_r"),
        ("com_y_m", 0.001, {"torques", "b3d"}, "centre of mass is 1.00 mm off"),
    ],
)
def test_a_number_that_was_altered_is_told(spoiled, column, by, checks, said):
    change(spoiled, FRAMES, **{column: one_more(first_counted(spoiled), by)})
    found = [one for one in checked(spoiled) if one.check != "files"]
    assert {(one.level.value, one.check) for one in found} == {("error", check) for check in checks}
    assert any(said in one.said for one in found)


def test_a_b3d_file_that_is_not_the_tables_is_told(spoiled):
    change(spoiled, FRAMES, missing_number=lambda values: [2, *values[1:]])
    (one,) = [one for one in checked(spoiled) if one.check != "files"]
    assert (one.check, one.where) == ("b3d", "b3d/Lab__at_100.b3d")
    assert "missing_GRF_reason is not the table's" in one.said
    (spoiled / "b3d/Lab__at_100.b3d").write_bytes(b"\0" * 100)
    assert any("no .b3d file" in one.said for one in checked(spoiled) if one.check == "b3d")


def rewritten(folder, path, remake):
    table = pq.read_table(folder / path)
    pq.write_table(remake(table), folder / path)


@pytest.mark.parametrize(
    ("remake", "said"),
    [
        (lambda t: t.drop_columns(["com_x_m"]), "lacks com_x_m"),
        (lambda t: t.append_column("mood", pa.array(["good"] * t.num_rows)), "has mood"),
        (lambda t: t.set_column(3, "frame", t["frame"].cast(pa.int64())), "frame is int64"),
        (lambda t: pa.concat_tables([t, t.slice(t.num_rows - 1)]), "rows with the same trial_id, frame"),
        (lambda t: t.take(pa.array(range(t.num_rows - 1, -1, -1))), "not sorted by trial_id, frame"),
        (lambda t: t.slice(1), "the manifest says"),
    ],
)
def test_a_table_that_is_not_the_schemas_is_told(spoiled, remake, said):
    rewritten(spoiled, FRAMES, remake)
    assert any(said in one.said for one in checked(spoiled) if one.check == "schema")


@pytest.mark.parametrize(("value", "said"), [(None, "has nulls"), (float("nan"), "has NaN")])
def test_values_that_must_not_be_there_are_told(spoiled, value, said):
    def remake(table):
        at, values = table.column_names.index("com_x_m"), table["com_x_m"].to_pylist()
        return table.set_column(
            at, pa.field("com_x_m", pa.float32()), pa.array([value, *values[1:]], pa.float32())
        )

    rewritten(spoiled, FRAMES, remake)
    assert any(said in one.said for one in checked(spoiled) if one.check == "schema")


def test_an_id_that_leads_nowhere_is_told(spoiled):
    change(spoiled, "segments.parquet", trial_id=lambda values: ["Lab/nobody/walk" for _ in values])
    assert any("'Lab/nobody/walk' is not in trials" in one.said for one in checked(spoiled))


@pytest.mark.parametrize(
    ("path", "columns", "said"),
    [
        ("subjects.parquet", {"age_years": lambda v: [200.0] * len(v)}, "age_years is 200"),
        ("subjects.parquet", {"mass_from_forces_kg": lambda v: [50.0] * len(v)}, "the plates carry 50.0 kg"),
        (FRAMES, {"qd_knee_angle_l": one_more(9, 80.0)}, "knee_angle_l turns at"),
        (FRAMES, {"marker_rms_m": lambda v: [0.09] * len(v)}, "markers are 9.0 cm off the skeleton"),
        (FRAMES, {f"cop_{s}_x_m": lambda v: [x and x + 0.5 for x in v] for s in "rl"}, "from its heel"),
        (
            FRAMES,
            {f"cop_{s}_{a}_m": lambda v: [x and 0.1 for x in v] for s in "rl" for a in "xyz"},
            "stands still from frame",
        ),
    ],
)
def test_what_bodies_and_plates_do_not_do_is_a_warning(spoiled, path, columns, said):
    change(spoiled, path, **columns)
    assert any(said in one.said for one in checked(spoiled) if one.level.value == "warning")


def test_persons_of_a_split_that_are_not_there_and_those_that_are_missing_are_told(spoiled):
    (spoiled / "splits").mkdir()
    pq.write_table(
        pa.table({"person_id": ["Lab/ghost"], "split": ["train"]}), spoiled / "splits" / "default.parquet"
    )
    said = {one.level.value: one.said for one in checked(spoiled)}
    assert said["error"] == "Lab/ghost is not in the release"
    assert "1 person is in none" in said["warning"]


def test_one_recording_of_two_persons_and_in_two_splits_is_told(spoiled):
    rename = {
        "subject_id": lambda values: [v and v.replace("at_100", "other") for v in values],
        "trial_id": lambda values: [v and v.replace("at_100", "other") for v in values],
        "segment_id": lambda values: [v and v.replace("at_100", "other") for v in values],
        "person_id": lambda values: [v and v.replace("at_100", "other") for v in values],
    }
    for path in sorted(spoiled.rglob("*.parquet")):
        table = pq.read_table(path)
        columns = {name: new for name, new in rename.items() if name in table.column_names}
        twin = path.with_name(path.name.replace("at_100", "other"))
        if twin != path:
            shutil.copy(path, twin)
            change(spoiled, twin.relative_to(spoiled), **columns)
        elif table.num_rows:
            shutil.copy(path, spoiled / "twin.parquet")
            change(spoiled, "twin.parquet", **columns)
            both = pa.concat_tables([table, pq.read_table(spoiled / "twin.parquet")])
            keys = [(name, "ascending") for name in ("subject_id", "trial_id") if name in both.column_names]
            pq.write_table(both.take(pc.sort_indices(both, keys)) if keys else both, path)
            (spoiled / "twin.parquet").unlink()
    for path in ("models/Lab__{}.osim", "b3d/Lab__{}.b3d"):
        shutil.copy(spoiled / path.format("at_100"), spoiled / path.format("other"))
    manifest = json.loads((spoiled / "manifest.json").read_text())
    manifest["files"] = {}
    (spoiled / "manifest.json").write_text(json.dumps(manifest))
    (spoiled / "splits").mkdir()
    split = pa.table({"person_id": ["Lab/at_100", "Lab/other"], "split": ["train", "test"]})
    pq.write_table(split, spoiled / "splits" / "default.parquet")
    said = [(one.check, one.said) for one in checked(spoiled) if one.check != "files"]
    assert {check for check, _ in said} == {"duplicates", "splits"}
    assert any("they are called two persons" in words for _, words in said)
    assert any("(train) and Lab/other/walk (test) are one recording" in words for _, words in said)
