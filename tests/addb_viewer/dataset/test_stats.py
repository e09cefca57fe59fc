"""Every number of the tables and figures against slow loops over the rows; and the paper's own table."""

import csv
import io
import math
import statistics

import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.dataset.release_tables import TRIALS
from addb_viewer.dataset.stats.drawing import (
    activity_figure,
    contact_figure,
    demographics_figure,
    quality_figure,
    scatter_figures,
    speed_length_figure,
)
from addb_viewer.dataset.stats.numbers import Frames, gathered
from addb_viewer.dataset.stats.page import (
    PAPER_SOURCES,
    PAPER_SUM,
    as_csv,
    clinical_percent,
    page,
    stats_of,
    write_stats,
)
from addb_viewer.text.amounts import counted, lasting
from tests.addb_viewer.dataset.synthetic_release import JOINTS, write, write_release
from tests.addb_viewer.shell import run

G = 9.80665
CLASS_OF = {"walk": "walking", "run": "running", "transition": "other", "none": "unlabelled"}
FIGURES = ("activity", "speed_length", "contact", "demographics", "quality", "angles_share", "moments_share",
           "angles_load", "moments_load", "joints_load")  # fmt: skip


@pytest.fixture(scope="module")
def release(tmp_path_factory):
    folder = tmp_path_factory.mktemp("release") / "small"
    return folder, write_release(folder)


def described(folder, frames):
    out = folder.with_name(f"stats-{frames}")
    result = CliRunner().invoke(
        app, ["dataset", "stats", str(folder), "--out", str(out), "--frames", frames], catch_exceptions=False
    )
    assert result.exit_code == 0, result.output
    return out, result.output


@pytest.fixture(scope="module")
def written(release):
    """Where the command has written everything, and what it said."""
    return described(release[0], "all")


@pytest.fixture(scope="module", params=list(Frames))
def stats(release, request):
    """The numbers as CSV, the rows of the release, and which of its frames count."""
    folder, rows = release
    found = stats_of(gathered(folder, request.param))
    reviewed = {trial["trial_id"]: trial["reviewed"] for trial in rows["trials"]}

    def chosen(frame):
        if request.param is Frames.ALL:
            return frame["counts"]
        if not reviewed[frame["trial_id"]]:
            return False
        return frame["counts"] and (request.param is Frames.REVIEWED or frame["detected_ok"])

    return {name: as_csv(table) for name, table in found.items()}, rows, chosen


def table(out, name):
    return list(csv.DictReader(io.StringIO(out[name])))


def number(text):
    return math.nan if text == "" else float(text)


def same(text, value):
    assert number(text) == pytest.approx(value, rel=2e-5, nan_ok=True)


def test_sources_count_persons_once_and_their_hours_add_up(stats):
    out, rows, chosen = stats
    told = table(out, "sources")
    source = {subject["subject_id"]: subject["source"] for subject in rows["subjects"]}
    for name, persons in (("field", 1), ("lab", 2)):
        (row,) = [r for r in told if r["source"] == name]
        frames = [f for f in rows["frames"] if source[f["subject_id"]] == name]
        assert int(row["subjects"]) == persons
        same(row["total_hours"], len(frames) / 100 / 3600)
        same(row["grf_hours"], sum(map(chosen, frames)) / 100 / 3600)
    *parts, total = told
    assert total["source"] == "Sum"
    for name in ("subjects", "total_hours", "grf_hours"):
        same(total[name], sum(float(part[name]) for part in parts))


def test_hours_of_each_class_are_those_of_its_frames(stats):
    out, rows, chosen = stats
    told = {row["activity"]: number(row["hours"]) for row in table(out, "activity")}
    for word, name in CLASS_OF.items():
        frames = sum(chosen(f) and f["activity"] == word for f in rows["frames"])
        assert told[name] == pytest.approx(frames / 100 / 3600, rel=2e-5)
    assert sum(told.values()) == pytest.approx(number(table(out, "sources")[-1]["grf_hours"]), rel=2e-5)


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.nan


def test_segments_hold_what_their_frames_say(stats):
    out, rows, chosen = stats
    told = {row["segment_id"]: row for row in table(out, "segments")}
    assert set(told) == {segment["segment_id"] for segment in rows["segments"]}
    subjects = {subject["subject_id"]: subject for subject in rows["subjects"]}
    trials = {trial["trial_id"]: trial for trial in rows["trials"]}
    for segment in rows["segments"]:
        row, subject = told[segment["segment_id"]], subjects[segment["subject_id"]]
        key = segment["trial_id"], segment["segment"]
        inside = [f for f in rows["frames"] if (f["trial_id"], f["segment"]) == key]
        counted = [f for f in inside if chosen(f)]
        used = [f for f in counted if f["used"]]
        assert int(row["frames"]) == len(inside)
        assert int(row["frames_with_force"]) == len(counted)
        has = trials[segment["trial_id"]]["has_dynamics"]
        assert int(row["frames_with_dynamics"]) == (len(used) if has else 0)
        same(row["speed_m_s"], segment["average_speed_m_s"] or math.nan)
        for phases, name in (((0,), "flight"), ((1, 2), "single"), ((3,), "double")):
            share = sum(f["phase"] in phases for f in counted) / len(counted) if counted else math.nan
            same(row[f"{name}_percent"], 100 * share)
        weight = subject["mass_kg"] * G
        force = [math.hypot(*(f[f"residual_force_{a}_N"] for a in "xyz")) / weight for f in used]
        moment = [math.hypot(*(f[f"residual_moment_{a}_Nm"] for a in "xyz")) / weight for f in used]
        same(row["linear_bw"], rms(force))
        same(row["angular_bwh"], rms(moment) / subject["height_m"])
        same(row["marker_cm"], 100 * rms([f["marker_rms_m"] for f in used if f["marker_rms_m"] is not None]))


def test_support_is_counted_over_frames_and_over_segments(stats):
    out, rows, chosen = stats
    told = {row["support"]: row for row in table(out, "contact")}
    frames = [f for f in rows["frames"] if chosen(f)]
    segments = [r for r in table(out, "segments") if int(r["frames_with_force"])]
    for phases, words, name in (((1, 2), "single support", "single"), ((3,), "double support", "double"),
                                ((0,), "flight", "flight")):  # fmt: skip
        same(told[words]["percent_of_frames"], 100 * sum(f["phase"] in phases for f in frames) / len(frames))
        mean = statistics.mean(number(r[f"{name}_percent"]) for r in segments)
        same(told[words]["percent_of_segments_mean"], mean)


def test_quality_is_the_mean_over_segments_plain_and_by_frames(stats):
    out, _, _ = stats
    segments = table(out, "segments")
    for row in table(out, "quality"):
        known = [r for r in segments if r[row["figure"]]]
        values = [number(r[row["figure"]]) for r in known]
        weights = [int(r["frames_with_dynamics"]) for r in known]
        assert int(row["n"]) == len(values) > 0
        same(row["mean"], statistics.mean(values))
        same(row["sd"], statistics.stdev(values))
        mean = sum(v * w for v, w in zip(values, weights, strict=True)) / sum(weights)
        spread = sum(w * (v - mean) ** 2 for v, w in zip(values, weights, strict=True)) / sum(weights)
        same(row["mean_by_frames"], mean)
        same(row["sd_by_frames"], math.sqrt(spread))


def test_clinical_hours_are_those_of_segments_within_both_limits(stats):
    out, _, _ = stats
    segments, grf = table(out, "segments"), number(table(out, "sources")[-1]["grf_hours"])
    limits = {"paper": (0.05, 0.1), "Hicks": (0.05, 0.01)}
    for row in table(out, "clinical"):
        linear, angular = limits[row["limits"]]
        inside = [
            int(r["frames_with_force"])
            for r in segments
            if r["linear_bw"] and number(r["linear_bw"]) <= linear and number(r["angular_bwh"]) <= angular
        ]
        assert int(row["segments"]) == len(inside)
        same(row["hours"], sum(inside) / 100 / 3600)
        same(row["percent_of_grf_hours"], 100 * sum(inside) / 100 / 3600 / grf)


def test_persons_are_described_once_whoever_has_several_subjects(stats):
    out, _, _ = stats
    told = table(out, "persons")
    assert [(r["person_id"], r["sex"], r["age_years"]) for r in told] == [
        ("field/c", "unknown", ""),
        ("lab/a", "female", "31"),
        ("lab/b", "male", "64"),
    ]
    both = {r["sex"]: r for r in table(out, "demographics") if r["persons"] == "all"}
    assert [both[sex]["n"] for sex in ("all", "female", "male", "unknown")] == ["3", "1", "1", "1"]
    same(both["all"]["age_years_mean"], 47.5)
    same(both["all"]["age_years_sd"], statistics.stdev([31, 64]))
    assert both["all"]["age_years_unknown"] == "1"


def test_scattered_frames_are_every_twentieth_of_those_that_count(stats):
    out, rows, chosen = stats
    told = {(r["trial_id"], int(r["frame"])): r for r in table(out, "scatter")}
    expected = {(f["trial_id"], f["frame"]): f for f in rows["frames"] if chosen(f) and f["frame"] % 20 == 0}
    assert set(told) == set(expected)
    mass = {subject["subject_id"]: subject["mass_kg"] for subject in rows["subjects"]}
    centres = {(c["trial_id"], c["frame"], c["joint"]): c for c in rows["joint_centres"]}
    for key, frame in expected.items():
        row, right, left = told[key], frame["grf_r_y_N"], frame["grf_l_y_N"]
        same(row["load_N_kg"], (right + left) / mass[frame["subject_id"]])
        same(row["right_share"], right / (right + left) if right + left > 20 else math.nan)
        same(row["q_knee_angle_r"], frame["q_knee_angle_r"])
        same(row["tau_knee_angle_r"], frame["tau_knee_angle_r"])
        assert row["q_hip_flexion_r"] == ""
        assert row["activity"] == CLASS_OF[frame["activity"]]
        for joint in JOINTS:
            c = centres[(*key, joint)]
            same(row[f"distance_{joint}_m"], math.hypot(*(c[f"root_{a}_m"] for a in "xyz")))


def test_all_figures_are_there_and_the_page_holds_them(written):
    out, said = written
    for name in FIGURES:
        assert (out / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
        assert "<svg" in (out / f"{name}.svg").read_text()
    shown = (out / "index.html").read_text()
    assert shown.count("data:image/png;base64,") == len(FIGURES)
    assert "http" not in shown
    assert "3 persons" in said


def test_the_files_hold_the_numbers(written, release):
    found = stats_of(gathered(release[0], Frames.ALL))
    assert {path.stem for path in written[0].glob("*.csv")} == set(found)
    for name, rows in found.items():
        assert (written[0] / f"{name}.csv").read_text() == as_csv(rows)


def test_the_same_numbers_give_the_same_picture():
    rows = [{"activity": "walking", "hours": 2.0}, {"activity": "jump", "hours": 0.1}]
    drawn = []
    for _ in range(2):
        file = io.BytesIO()
        activity_figure(rows).savefig(file, format="svg", metadata={"Date": None})
        drawn.append(file.getvalue())
    assert drawn[0] == drawn[1]


def test_labels_lie_inside_the_figures_and_segments_are_counted_in_whole_numbers(release):
    """Of a release with few segments, for which fractions would be drawn."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    tables = stats_of(gathered(release[0], Frames.ALL))
    of_segments = [draw(tables["segments"]) for draw in (speed_length_figure, contact_figure, quality_figure)]
    for figure in (*of_segments, activity_figure(tables["activity"]), demographics_figure(tables["persons"])):
        figure.draw_without_rendering()
        inside = figure.bbox.padded(1)
        renderer = FigureCanvasAgg(figure).get_renderer()
        for axes in figure.axes:
            texts = [axes.xaxis.label, axes.yaxis.label, *axes.texts]
            texts += axes.get_legend().get_texts() if axes.get_legend() else []
            for box in (text.get_window_extent(renderer) for text in texts if text.get_text()):
                assert inside.x0 <= box.x0 and box.x1 <= inside.x1, axes.get_xlabel()  # noqa: PT018
                assert inside.y0 <= box.y0 and box.y1 <= inside.y1, axes.get_xlabel()  # noqa: PT018
    for axes in (axes for figure in of_segments for axes in figure.axes):
        assert all(tick == round(tick) for tick in axes.get_yticks())


def test_panels_leave_room_for_the_titles_of_those_below(release):
    """A row of panels ends above the titles of the next."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = scatter_figures(gathered(release[0], Frames.ALL).points)["joints_load"]
    figure.savefig(io.BytesIO(), format="svg")  # which must not lay it out anew
    figure.set_size_inches(13, 4.6)
    upper, lower = figure.subplots(2, 1)  # stand-ins with the figure's own margins
    for place in (upper, lower):
        place.set_title("title")
    renderer = FigureCanvasAgg(figure).get_renderer()
    assert upper.get_tightbbox(renderer).y0 > lower.title.get_window_extent(renderer).y1


def test_a_release_without_reviewed_frames_says_so_and_has_no_empty_figure(tmp_path):
    release, out = tmp_path / "r", tmp_path / "out"
    rows = write_release(release)
    write(release, TRIALS, [trial | {"reviewed": False} for trial in rows["trials"]])
    write_stats(release, out, Frames.ALL)
    assert (out / "quality.png").is_file()
    _, _, path = write_stats(release, out, Frames.PAPER)
    told = path.read_text()
    assert "No frame of this release is such a frame" in told
    assert "Nothing is known of this." in told
    assert "± –" not in told
    assert not {"activity", "quality", "joints_load"} & {file.stem for file in out.glob("*.png")}


def test_one_value_has_no_spread(release):
    found = gathered(release[0], Frames.ALL)
    tables = stats_of(found)
    alone = [row | {"n": 1, "age_years_sd": math.nan, "bmi_sd": math.nan} for row in tables["demographics"]]
    quality = [row | {"n": 1, "sd": math.nan} for row in tables["quality"]]
    told = page("r", Frames.ALL, tables | {"demographics": alone, "quality": quality}, {})
    people, marker = told.split("People</h2>")[1], f"<td>{quality[0]['mean']:.2f}</td>"
    assert "±" not in people.split("</table>")[0]
    assert marker in told


@pytest.mark.slow
def test_figures_of_a_release_that_nobody_reviewed_show_all_frames(tmp_path):
    rows = write_release(tmp_path / "r")
    write(tmp_path / "r", TRIALS, [trial | {"reviewed": False} for trial in rows["trials"]])
    result = CliRunner().invoke(app, ["dataset", "stats", str(tmp_path / "r")], catch_exceptions=False)
    told = table({"sources": (tmp_path / "r.stats" / "sources.csv").read_text()}, "sources")
    assert number(told[-1]["grf_hours"]) == pytest.approx(
        sum(frame["counts"] for frame in rows["frames"]) / 100 / 3600, rel=2e-5
    )
    assert "figures are about all that count" in result.output


def test_the_papers_sources_sum_to_what_it_prints():
    assert sum(s.subjects for s in PAPER_SOURCES) == 273 == PAPER_SUM.subjects
    total = sum(s.total_hours for s in PAPER_SOURCES)
    forces = sum(s.grf_hours for s in PAPER_SOURCES)
    assert total == pytest.approx(71.47, abs=1e-9) == PAPER_SUM.total_hours
    assert forces == pytest.approx(57.55, abs=1e-9) == PAPER_SUM.grf_hours


def test_the_page_states_both_percentages_of_the_papers_clinical_hours(written):
    assert round(clinical_percent(), 1) == 21.0
    told = (written[0] / "index.html").read_text()
    assert "21.2 %" in told
    assert "21.0 %" in told


@pytest.mark.parametrize(
    ("hours", "words"),
    [(12.34, "12.3 h"), (0.5, "30.0 min"), (0.005, "18 s"), (0.48 / 3600, "0.5 s"), (0, "0 s")],
)
def test_durations_are_told_as_people_say_them(hours, words):
    assert lasting(hours) == words


def test_one_person_is_not_one_persons():
    assert [counted(number, "person") for number in (0, 1, 2)] == ["0 persons", "1 person", "2 persons"]


def test_a_folder_that_is_no_release_is_told(tmp_path):
    result = run("dataset", "stats", tmp_path)
    assert result.exit_code == 1
    assert "subjects.parquet: no such file; give the folder of a release" in " ".join(result.output.split())
