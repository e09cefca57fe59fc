"""The examples run as they stand, one after the other in one folder, and end in what they promise."""

import json
import runpy
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from addb_viewer import Subject
from addb_viewer.dataset.release_tables import CONTACTS, FRAMES, SUBJECTS
from tests.addb_viewer.dataset.synthetic_release import write

matplotlib = pytest.importorskip("matplotlib", reason="Matplotlib is not installed")
matplotlib.use("Agg")
plt = pytest.importorskip("matplotlib.pyplot")
EXAMPLES = Path(__file__).parents[2] / "examples"
NEEDS_A_RELEASE = Path(__file__).parents[1] / "addb_viewer" / "benchmark" / "test_evaluating.py"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the examples run: the first one's fit is there for the others."""
    place = tmp_path_factory.mktemp("examples")
    return place


@pytest.fixture
def run(folder, monkeypatch, capsys, request):
    """Runs an example; what it printed, and the curves of each picture that it showed."""
    monkeypatch.chdir(folder)
    pictures = []

    def show():
        for number in plt.get_fignums():
            figure = plt.figure(number)
            figure.savefig(folder / f"{request.node.name}-{len(pictures)}.png")
            pictures.append([[line.get_ydata() for line in axes.lines] for axes in figure.axes])
        plt.close("all")

    monkeypatch.setattr(plt, "show", show)
    monkeypatch.setattr(Subject, "demo", partial(Subject.demo, trials=("static", "walk")))

    def runs(name):
        if name.endswith(".ipynb"):
            cells = json.loads((EXAMPLES / name).read_text(encoding="utf-8"))["cells"]
            names = {"__name__": "__main__"}
            for cell in cells:
                if cell["cell_type"] == "code":
                    exec(compile("".join(cell["source"]), name, "exec"), names)
        else:
            names = runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        return names, capsys.readouterr().out, pictures

    return runs


def test_every_example_is_numbered_described_and_tested():
    scripts = sorted(path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".ipynb"))
    assert [int(name[:2]) for name in scripts] == list(range(1, len(scripts) + 1))
    listed = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    tested = Path(__file__).read_text(encoding="utf-8")
    for name in scripts:
        assert f"]({name})" in listed
        assert f'run("{name}")' in tested or f'"{name}"' in NEEDS_A_RELEASE.read_text(encoding="utf-8")


@pytest.mark.slow
def test_ten_lines_end_in_a_plot(run):
    names, _, pictures = run("01_torque_plot.py")
    lines = (EXAMPLES / "01_torque_plot.py").read_text(encoding="utf-8").splitlines()
    assert sum(bool(line.strip()) for line in lines[1:]) == 10  # below the sentence on what it is
    ((curves,),) = pictures
    assert len(curves) == 2
    for curve in curves:  # knee torques of a walk: tens of newton metres, both ways
        assert np.ptp(curve) > 20
        assert np.abs(curve).max() < 150
    assert names["walk"].used.sum() > 200


@pytest.mark.slow
def test_arrays_from_memory_give_the_fit_of_the_files(run):
    names, said, _ = run("02_arrays.py")
    whole = names["Subject"].open("demo_subject").last_fit()["walk"].coordinates
    part = names["stretch"].coordinates
    knee = "knee_angle_r"
    apart = np.rad2deg(np.abs(part[knee] - whole[knee][: len(part)]))
    assert np.median(apart) < 2.0  # scaled and fitted to another stretch
    assert "stretch" in said


@pytest.mark.slow
def test_tables(run):
    pytest.importorskip("polars", reason="Polars is not installed")
    names, said, _ = run("03_tables.py")
    from pyarrow import parquet

    assert parquet.read_table("walk.parquet").num_rows == names["walk"].frames
    assert 0.5 < names["fit"].cycles["speed_m_s"].min() < 2.5
    assert "work_J" in said


@pytest.mark.slow
def test_a_missed_step_taken_for_measured_leaves_a_residual(run):
    names, _, pictures = run("04_review.py")
    ((wrong, right, *_),) = pictures[0]
    step = slice(names["step"]["start"], names["step"]["end"])
    assert np.nanmax(wrong[step]) > 5 * np.nanmax(right)
    assert np.isnan(right[step]).all()
    assert len(names["subject"].flags) == 0


@pytest.mark.slow
def test_the_diagnosis_finds_what_the_demo_hides(run):
    names, said, pictures = run("05_diagnose.ipynb")
    causes = {cause.id: cause for cause in names["diagnosis"]}
    assert causes["clock_offset"].parameters["offset_s"].value == pytest.approx(0.012, abs=0.001)
    residual = [
        fit.figures["trials"][0]["linear_residual"]["rms_N"] for fit in (names["before"], names["after"])
    ]
    assert residual[1] < residual[0] / 2
    assert "VERDICT" in said
    assert len(pictures) == 3


@pytest.mark.slow
def test_many_subjects(run):
    _, said, _ = run("06_many_subjects.py")
    assert "empty_subject: left out: " in said
    assert Path("demo_subject/results/report.html").stat().st_size > 100_000
    assert list(Path("demo_subject/results/opensim").glob("*.osim"))


def test_ten_peoples_knees_from_a_release(run, folder):
    """Of a release whose torque is a known wave over each cycle of 100 frames."""
    pytest.importorskip("polars", reason="Polars is not installed")
    rows, people = (
        [],
        [{"subject_id": f"lab/S{k}", "person_id": f"lab/P{k}", "mass_kg": 50 + k} for k in range(11)],
    )
    for k, who in enumerate(people):
        trial = f"{who['subject_id']}/walk"
        rows += [
            {"trial_id": trial, "foot": foot, "start_frame": start, "end_frame": start + 60}
            for foot, first in (("left", 55), ("right", 5))
            for start in (first, first + 100, first + 200)
        ]
        wave = (k + 1) * who["mass_kg"] * np.sin(2 * np.pi * (np.arange(300) - 5) / 100)
        frames = [
            {
                "subject_id": who["subject_id"],
                "trial_id": trial,
                "frame": f,
                "activity": "walk",
                "counts": f != 150,
            }
            | {"tau_knee_angle_r": wave[f]}
            for f in range(300)
        ]
        write(folder / "release", FRAMES, frames, f"lab__S{k}")
    write(folder / "release", SUBJECTS, people)
    write(folder / "release", CONTACTS, rows)
    names, said, (((*curves,),),) = run("07_dataset.py")
    assert len(curves) == 10
    assert len({round(float(curve.max())) for curve in curves}) == 10
    for k in range(11):
        (cycle,) = names["cycles"][f"lab/P{k}"]  # the other one has a frame that does not count
        np.testing.assert_allclose(cycle, (k + 1) * np.sin(2 * np.pi * np.arange(101) / 100), atol=1e-4)
    assert f"Polars: {11 * 299} frames" in said
    assert f"PyArrow: {11 * 299} frames" in said
