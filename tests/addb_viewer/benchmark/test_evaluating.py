"""Evaluation on a release of simulated persons: who is opened, who is caught, what is kept."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.evaluating import TimeHistory, evaluate, evaluate_outside, train
from addb_viewer.benchmark.predictors import filtered, predictor
from addb_viewer.benchmark.release_trials import open_for_benchmark, shown_skeleton
from addb_viewer.benchmark.results import FORCE, MOMENT, read_outside, read_results, write_result
from addb_viewer.benchmark.scoring import completed
from addb_viewer.benchmark.task import FEET, BenchmarkError, Predicted
from addb_viewer.commands.cli import app
from tests.addb_viewer.benchmark.simulated_release import GRAVITY, NOISE_RAD, truth

TESTED = ("lab/p3", "lab/p4", "lab/p5")


@pytest.fixture(scope="module")
def source(release):
    return open_for_benchmark(release)


class Mean:
    """Half of the weight on either foot; remembers whom it has met."""

    name = "mean"

    def __init__(self):
        self.met = []

    def fit(self, train, dev, log):
        self.met = [example.person_id for part in (train, dev) for example in part]
        log(persons=len(set(self.met)))

    def predict(self, seen):
        force = np.tile(-seen.mass_kg * seen.skeleton.gravity / 2, (seen.frames, 2, 1))
        return Predicted(force, np.zeros_like(force))


def test_what_is_shown_is_the_noisy_motion_and_the_entered_mass(source):
    (example,) = source.trials(frozenset({"lab/p4"}))
    skeleton, (q, _, _), *_ = truth("walk")
    off = example.seen.q - q
    assert 0.5 * NOISE_RAD < off.std() < 2 * NOISE_RAD
    assert example.seen.mass_kg == pytest.approx(81.0)
    assert example.measured.mass_kg == pytest.approx(80.0)
    assert example.seen.skeleton.dofs == skeleton.dofs
    with pytest.raises(ValueError, match="read-only"):
        example.seen.q[0, 0] = 1.0
    assert not {"person_id", "trial_id", "force", "counts"} & set(vars(example.seen))


def test_the_fitted_skeleton_is_shown_where_that_is_asked_for(release):
    assert shown_skeleton(open_for_benchmark(release, "fitted"), "lab/p4").mass == pytest.approx(80.0)


def test_who_was_not_weighed_is_tested_only_where_that_is_asked_for(release, tmp_path):
    copy = shutil.copytree(release, tmp_path / "one lacks a mass")
    rows = pq.read_table(copy / "subjects.parquet").to_pylist()
    for row in rows:
        row["mass_entered_kg"] = None if row["subject_id"] == "lab/p4" else row["mass_entered_kg"]
    schema = pq.read_schema(copy / "subjects.parquet")
    pq.write_table(pa.Table.from_pylist(rows, schema=schema), copy / "subjects.parquet")
    (copy / "models" / "lab__p4.unfitted.osim").unlink()
    tested = evaluate(open_for_benchmark(copy), Mean, TimeHistory(), tmp_path / "a")
    assert {score.person_id for score in tested.scores} == {"lab/p3", "lab/p5"}
    assert not tested.notes
    asked = evaluate(open_for_benchmark(copy, unweighed=True), Mean, TimeHistory(), tmp_path / "b")
    assert {score.person_id for score in asked.scores} == set(TESTED)
    assert "lab/p4: no mass was entered" in asked.notes[0]


def test_a_gap_parts_a_trial(source, release, tmp_path):
    copy = shutil.copytree(release, tmp_path / "gap")
    for table in ("frames", "kinematics"):
        path = copy / table / "lab__p4.parquet"
        rows = pq.read_table(path)
        pq.write_table(pa.concat_tables([rows.slice(0, 40), rows.slice(50)]), path)
    parts = list(open_for_benchmark(copy).trials(frozenset({"lab/p4"})))
    assert [(p.frame[0], p.frame[-1], p.seen.frames) for p in parts] == [(0, 39, 40), (50, 120, 71)]
    (whole,) = source.trials(frozenset({"lab/p4"}))
    np.testing.assert_array_equal(parts[1].measured.force, whole.measured.force[50:])


def test_the_baseline_on_all_tested_persons(source, tmp_path):
    result = evaluate(source, filtered, TimeHistory(), tmp_path)
    assert {score.person_id for score in result.scores} == set(TESTED)
    force = average(result.scores, "grf")
    assert (force.persons, force.trials, force.frames) == (3, 5, 5 * 76)
    # By a loop over the release's rows, the force alone.
    errors = []
    for example in source.trials(frozenset({"lab/p4"})):
        told = filtered().predict(example.seen).force
        errors += [
            np.mean([np.linalg.norm(told[t, k] - example.measured.force[t, k]) for k in (0, 1)]) / 80.0
            for t in range(45, 121)
        ]
    own = [s for s in result.scores if s.person_id == "lab/p4"]
    assert average(own, "grf").mean == pytest.approx(np.mean(errors))


def test_training_opens_no_file_of_a_tested_person(release, tmp_path):
    copy = shutil.copytree(release, tmp_path / "spoilt")
    for path in copy.glob("*/lab__p[345].*"):
        path.write_bytes(b"nobody may read this")
    learner = Mean()
    train(open_for_benchmark(copy), lambda: learner, TimeHistory(), tmp_path / "work")
    assert set(learner.met) == {"lab/p0", "lab/p1", "lab/p2"}
    assert (tmp_path / "work/mean/test/log.csv").read_text().split() == ["persons", "3"]
    with pytest.raises(Exception, match=r"[Pp]arquet|model|XML"):
        evaluate(open_for_benchmark(copy), lambda: learner, TimeHistory(), tmp_path / "work")


def test_others_cannot_be_opened_by_their_name(source):
    trials = source.trials(frozenset({"lab/p0"}))
    with pytest.raises(AssertionError, match="lab/p4"):
        next(trials.of_subject("lab/p4"))


def test_folds_leave_their_own_persons_out(source, release):
    path = release / "splits" / "folds.parquet"
    table = pq.read_table(release / "splits" / "default.parquet")
    folds = pa.array([f"fold{k % 3}" for k in range(6)])
    pq.write_table(table.set_column(1, table.schema.field("split"), folds), path)
    parts = source.parts("folds", "fold1")
    assert parts.test == {"lab/p1", "lab/p4"}
    assert parts.dev == {"lab/p2", "lab/p5"}
    assert parts.train == {"lab/p0", "lab/p3"}
    with pytest.raises(BenchmarkError, match="fold0, fold1, fold2"):
        source.parts("folds", "test")


class Hoarding(Mean):
    """Never forgets whom it has learnt from."""

    name = "hoarding"

    def __init__(self):
        self.hoard = []
        MADE.append(self)

    def fit(self, train, dev, log):
        self.hoard += [example.seen.skeleton for part in (train, dev) for example in part]


MADE: list[Hoarding] = []


def test_what_is_learnt_in_a_fold_stays_in_it(source, release, tmp_path):
    path = release / "splits" / "own.parquet"
    table = pq.read_table(release / "splits" / "default.parquet")
    folds = pa.array([f"fold{k % 3}" for k in range(6)])
    pq.write_table(table.set_column(1, table.schema.field("split"), folds), path)
    time_history = TimeHistory("own", ("fold0", "fold1", "fold2"))
    for run in (train, evaluate):
        MADE.clear()
        run(source, Hoarding, time_history, tmp_path)
        tested = [len(list(source.trials(source.parts("own", part).test))) for part in time_history.parts]
        assert [len(one.hoard) for one in MADE] == [sum(tested) - own for own in tested]


class Peeking(Mean):
    """Finds the recording whose motion it is shown, and reads the forces there."""

    name = "peeking"

    def __init__(self, source):
        self.source = source

    def fit(self, train, dev, log):
        pass

    def predict(self, seen):
        everybody = self.source.trials(frozenset(self.source.release.split()))
        found = next(e for e in everybody if np.array_equal(e.seen.q, seen.q))
        return Predicted(found.measured.force, found.measured.moment)


def test_who_peeks_is_caught(source, tmp_path):
    with pytest.raises(BenchmarkError, match="has seen the forces"):
        evaluate(source, lambda: Peeking(source), TimeHistory(), tmp_path)


def answer_rows(example, predicted):
    """An answer as rows of a file of answers made elsewhere."""
    count, feet = example.seen.frames, len(FEET)
    values = np.concatenate([predicted.force, predicted.moment], axis=2).reshape(count * feet, 6)
    return pa.table(
        {
            "subject_id": [example.subject_id] * (count * feet),
            "trial_id": [example.trial_id] * (count * feet),
            "frame": pa.array(np.repeat(example.frame, feet), pa.int32()),
            "foot": list(FEET) * count,
            **{name: values[:, k] for k, name in enumerate((*FORCE, *MOMENT))},
        }
    )


def test_outside_answers_score_as_inside(source, tmp_path):
    mine = Mean()
    inside = evaluate(source, lambda: mine, TimeHistory(), tmp_path)
    rows = pa.concat_tables(
        [answer_rows(example, mine.predict(example.seen)) for example in source.trials(frozenset(TESTED))]
    )
    shuffled = rows.take(np.random.default_rng(0).permutation(rows.num_rows))
    pq.write_table(shuffled, tmp_path / "theirs.parquet")
    outside = evaluate_outside(source, read_outside(tmp_path / "theirs.parquet"), TimeHistory())
    assert outside.name == "theirs"
    assert outside.scores == inside.scores
    pq.write_table(rows.slice(1), tmp_path / "short.parquet")
    with pytest.raises(BenchmarkError, match="frame 0, foot r"):
        evaluate_outside(source, read_outside(tmp_path / "short.parquet"), TimeHistory())
    pq.write_table(pa.concat_tables([rows, rows.slice(0, 1)]), tmp_path / "twice.parquet")
    with pytest.raises(BenchmarkError, match="twice"):
        evaluate_outside(source, read_outside(tmp_path / "twice.parquet"), TimeHistory())
    pq.write_table(rows.drop_columns(["nz"]), tmp_path / "lacking.parquet")
    with pytest.raises(BenchmarkError, match="nz"):
        read_outside(tmp_path / "lacking.parquet")


def test_accelerations_are_completed_by_the_forces_told(source):
    (example,) = source.trials(frozenset({"lab/p4"}))
    whole = completed(example.seen, Mean().predict(example.seen))
    np.testing.assert_allclose(whole.com_acceleration, 0.0, atol=1e-9)
    assert -GRAVITY[1] * example.seen.mass_kg / 2 == pytest.approx(whole.force[0, 0, 1])


def test_results_of_other_terms_stand_in_no_table_together(source, tmp_path):
    result = evaluate(source, Mean, TimeHistory(), tmp_path / "work")
    write_result(result, tmp_path)
    assert read_results(tmp_path) == (result,)
    fewer = replace(result, name="fewer", scores=result.scores[len(result.scores) // 2 :])
    write_result(fewer, tmp_path)
    with pytest.raises(BenchmarkError, match="fewer and mean were scored on different frames"):
        read_results(tmp_path)
    for path in tmp_path.glob("fewer.*"):
        path.unlink()
    other = replace(result, name="other", terms=replace(result.terms, skeleton="fitted"))
    write_result(other, tmp_path)
    with pytest.raises(BenchmarkError, match="skeleton: unfitted and fitted"):
        read_results(tmp_path)


THEIRS = Path(__file__).parents[3] / "examples" / "08_own_predictor.py"


def test_the_commands(release, tmp_path):
    run = CliRunner().invoke
    out = ["--out", str(tmp_path / "out")]
    asked = ["--predictor", "analytical-30Hz", "--predictor", f"{THEIRS}:Regression"]
    assert run(app, ["benchmark", "train", str(release), *asked, *out]).exit_code == 0
    done = run(app, ["benchmark", "evaluate", str(release), *asked, *out])
    assert done.exit_code == 0, done.output
    assert "regression: GRF" in done.output
    table = run(app, ["benchmark", "table", str(tmp_path / "out")]).output
    rows = [line.split(" | ")[0] for line in table.splitlines()]
    assert rows.count("| regression") == 3
    assert "| MLP (paper)" in rows
    assert "not comparable" in table
    force = average(read_results(tmp_path / "out")[1].scores, "grf").mean
    assert f"{force:.3f} (–)" in table  # three persons: no interval
    latex = run(app, ["benchmark", "table", str(tmp_path / "out"), "--format", "latex"]).output
    assert latex.count("\\\\") == 1 + 2 + 1 + 6
    csv = run(app, ["benchmark", "table", str(tmp_path / "out"), "--format", "csv"]).output
    assert f"regression,grf,N/kg,all,{force}," in csv
    swept = run(app, ["benchmark", "sweep", str(release), *out])
    assert swept.exit_code == 0, swept.output
    assert {Path(line).name for line in swept.output.split()} == {"sweep.csv", "sweep.svg", "sweep.png"}


def test_names_that_are_none_are_told():
    with pytest.raises(BenchmarkError, match=r"no predictor 'mpl'; there are analytical"):
        predictor("mpl")
    with pytest.raises(BenchmarkError, match="no such file"):
        predictor("nowhere.py:Thing")


def test_a_release_at_native_rates_is_refused(release, tmp_path):
    copy = shutil.copytree(release, tmp_path / "native")
    manifest = json.loads((copy / "manifest.json").read_text())
    (copy / "manifest.json").write_text(json.dumps(manifest | {"rate_hz": None}))
    with pytest.raises(BenchmarkError, match="the recordings' own rates"):
        open_for_benchmark(copy)
