"""Learnt predictors: what they see, that training resumes exactly, and whom it opens."""

import csv
import shutil
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.evaluating import FolderLog, TimeHistory, evaluate
from addb_viewer.benchmark.learnt.training_windows import (
    BELOW_ROOT,
    LENGTH,
    SIZES,
    ends_of_all,
    features_of,
    targets_of,
    windows_of,
    wrenches_of,
)
from addb_viewer.benchmark.release_trials import open_for_benchmark
from addb_viewer.benchmark.task import BenchmarkError
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import body_poses
from tests.addb_viewer.benchmark.simulated_release import example

WITH_TORCH = pytest.mark.skipif(
    not __import__("importlib.util").util.find_spec("torch"),
    reason="PyTorch is not installed: pip install -r requirements-benchmark.lock",
)


@pytest.fixture(scope="module")
def source(release):
    return open_for_benchmark(release)


@pytest.fixture(scope="module")
def walk():
    return example()


def turned(one):
    """The same walk elsewhere, another way round: shown motion and measured forces."""
    R = Rotation.from_euler("y", 70, degrees=True).as_matrix()
    shift = np.array([3.0, 0.0, -2.0])
    root = root_joint(one.seen.skeleton)
    rotation, place = body_poses(one.seen.skeleton, one.seen.q)
    q = one.seen.q.copy()
    q[:, root.dofs] = root.coordinates(R @ rotation[:, root.body], place[:, root.body] @ R.T + shift)
    for k in root.rotation_dofs:
        q[:, k] = np.unwrap(q[:, k])
    measured = replace(
        one.measured,
        force=one.measured.force @ R.T,
        moment=one.measured.moment @ R.T,
        foot_ground=one.measured.foot_ground @ R.T + shift,
    )
    return replace(one.seen, q=q), measured


@pytest.mark.parametrize("kind", ["plain", "wide"])
def test_features_and_targets_do_not_depend_on_place_and_heading(walk, kind):
    seen, measured = turned(walk)
    features, pose = features_of(seen, kind)
    wanted, wanted_pose = features_of(walk.seen, kind)
    assert wanted.shape == (walk.seen.frames, SIZES[kind])
    np.testing.assert_allclose(features, wanted, atol=1e-6)
    np.testing.assert_allclose(
        targets_of(seen, measured, pose), targets_of(walk.seen, walk.measured, wanted_pose), atol=1e-9
    )


def test_wide_features_have_velocities_and_the_roots_past(walk):
    wide, pose = features_of(walk.seen, "wide")
    plain, _ = features_of(walk.seen)
    np.testing.assert_array_equal(wide[:, : SIZES["plain"]], plain)
    more = wide[:, SIZES["plain"] :]
    knee = BELOW_ROOT.index("knee_angle_r")
    q = walk.seen.q[:, walk.seen.skeleton.dofs.index("knee_angle_r")]
    assert more[60, knee] == pytest.approx((q[61] - q[59]) * walk.seen.rate / 2)
    R, p = pose.R_ground_root, pose.p_ground
    speed, spin = np.split(more[60, len(BELOW_ROOT) : len(BELOW_ROOT) + 6], 2)
    np.testing.assert_allclose(R[60] @ speed, (p[61] - p[59]) * walk.seen.rate / 2, atol=1e-9)
    axial = (R[61] - R[59]) @ R[60].T * walk.seen.rate / 2  # Ṙ Rᵀ is the cross product with the spin
    np.testing.assert_allclose(R[60] @ spin, [axial[2, 1], axial[0, 2], axial[1, 0]], atol=2e-3)
    past = more[60, len(BELOW_ROOT) + 6 :].reshape(10, 6)
    np.testing.assert_allclose(R[60] @ past[2, :3] + p[60], p[45], atol=1e-9)
    np.testing.assert_allclose(R[60] @ Rotation.from_rotvec(past[2, 3:]).as_matrix(), R[45], atol=1e-9)
    np.testing.assert_allclose(R[60] @ past[9, :3] + p[60], p[10], atol=1e-9)


def test_what_is_told_becomes_forces_again(walk):
    _, pose = features_of(walk.seen)
    force, moment = wrenches_of(targets_of(walk.seen, walk.measured, pose), walk.seen, pose)
    np.testing.assert_allclose(force, walk.measured.force, atol=1e-9)
    np.testing.assert_allclose(moment, walk.measured.moment, atol=1e-9)


def test_windows_are_every_fifth_of_fifty_frames(source, tmp_path):
    persons = frozenset({"lab/p1", "lab/p2"})
    windows = windows_of(source.trials(persons), tmp_path)
    rows = [features_of(one.seen)[0] for one in source.trials(persons)]
    assert len(windows) == 3 * 76
    got, targets = windows.some(np.array([76 + 10]))  # frame 55 of the second trial
    np.testing.assert_allclose(got[0], rows[1][10:56:5].astype(np.float32))
    assert LENGTH == 10
    second = list(source.trials(persons))[1]
    told = targets_of(second.seen, second.measured, features_of(second.seen)[1])
    np.testing.assert_allclose(targets[0], told[55].astype(np.float32))
    everything = np.concatenate(rows)
    scales = windows.scales()
    np.testing.assert_allclose(scales["feature_mean"], everything.mean(axis=0), rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(ends_of_all(60)[55], np.arange(10, 56, 5))
    assert ends_of_all(60)[3].tolist() == [0] * 9 + [3]


def test_windows_are_made_once_and_anew_for_others(source, tmp_path):
    windows_of(source.trials(frozenset({"lab/p0"})), tmp_path)
    made = (tmp_path / "features.f32").stat().st_mtime_ns
    windows_of(source.trials(frozenset({"lab/p0"})), tmp_path)
    assert (tmp_path / "features.f32").stat().st_mtime_ns == made
    assert len(windows_of(source.trials(frozenset({"lab/p1"})), tmp_path)) == 2 * 76


def quick(name, features="plain", start=None, **settings):
    from addb_viewer.benchmark.learnt.predictor import learnt
    from addb_viewer.benchmark.learnt.training import TrainingSettings

    return learnt(name, TrainingSettings(**{"epochs": 2} | settings), features=features, start=start)


def weights(predictor):
    return {name: value.numpy() for name, value in predictor.network.state_dict().items()}


@WITH_TORCH
@pytest.mark.parametrize("name", ["mlp", "groundlinknet"])
def test_a_resumed_training_equals_an_undisturbed_one(source, tmp_path, name):
    parts = source.parts("default", "test")
    train, dev = source.trials(frozenset(sorted(parts.train)[:1])), source.trials(parts.dev)

    class Killed(FolderLog):
        def __call__(self, **figures):
            raise KeyboardInterrupt

    straight, interrupted, again = quick(name), quick(name), quick(name)
    straight.fit(train, dev, FolderLog(tmp_path / "straight"))
    with pytest.raises(KeyboardInterrupt):
        interrupted.fit(train, dev, Killed(tmp_path / "killed"))
    assert interrupted.network is None
    again.fit(train, dev, FolderLog(tmp_path / "killed"))
    for key, value in weights(straight).items():
        np.testing.assert_array_equal(weights(again)[key], value)
    other = quick(name, seed=1)
    other.fit(train, dev, FolderLog(tmp_path / "other"))
    assert any(not np.array_equal(weights(other)[key], value) for key, value in weights(straight).items())
    with (tmp_path / "killed/log.csv").open() as file:
        assert [row["epoch"] for row in csv.DictReader(file)] == ["2"]


@WITH_TORCH
def test_it_learns_and_opens_no_tested_person(release, tmp_path):
    copy = shutil.copytree(release, tmp_path / "spoilt")
    for path in copy.glob("*/lab__p[345].*"):
        path.write_bytes(b"nobody may read this")
    spoilt = open_for_benchmark(copy)
    parts = spoilt.parts("default", "test")
    predictor = quick("mlp", epochs=12, learning_rate=1e-3)
    log = FolderLog(tmp_path / "work/mlp/test")
    predictor.fit(spoilt.trials(parts.train), spoilt.trials(parts.dev), log)
    with (log.folder / "log.csv").open() as file:
        losses = [float(row["dev_loss"]) for row in csv.DictReader(file)]
    assert min(losses) < 0.5 * losses[0]
    # The same data, not spoilt: the checkpoint is taken as it is, and scored.
    whole = open_for_benchmark(release)
    result = evaluate(whole, lambda: predictor, TimeHistory(), tmp_path / "work")
    assert len((log.folder / "log.csv").read_text().splitlines()) == 13
    assert {score.person_id for score in result.scores} == {"lab/p3", "lab/p4", "lab/p5"}


@pytest.fixture(scope="module")
def trained(release, tmp_path_factory):
    """Results of an MLP that has learnt from the first of the persons alone."""
    results = tmp_path_factory.mktemp("trained")
    source = open_for_benchmark(release)
    one, dev = (source.trials(frozenset({name})) for name in ("lab/p0", "lab/p2"))
    quick("mlp", epochs=1).fit(one, dev, FolderLog(results / "work/mlp/test"))
    return results


@WITH_TORCH
def test_a_training_goes_on_from_weights_of_other_persons(source, trained, tmp_path):
    from addb_viewer.benchmark.learnt.training import start_of

    begun = start_of(trained / "work/mlp/test/checkpoint.pt")
    parts = source.parts("default", "test")
    train, dev = source.trials(parts.train), source.trials(parts.dev)
    still = quick("mlp", start=trained, epochs=0)
    assert still.name == "mlp-started"
    assert still.knows == {"lab/p0", "lab/p2"}
    still.fit(train, dev, FolderLog(tmp_path / "still"))
    for key, value in weights(still).items():  # scales too: features mean what they meant there
        np.testing.assert_array_equal(value, begun.weights[key].numpy())
    on = quick("mlp", start=trained)
    on.fit(train, dev, FolderLog(tmp_path / "on"))
    assert any(not np.array_equal(weights(on)[key], value) for key, value in weights(still).items())
    worse = quick("mlp", start=trained, epochs=1, learning_rate=10.0)
    worse.fit(train, dev, FolderLog(tmp_path / "worse"))
    for key, value in weights(worse).items():
        np.testing.assert_array_equal(value, weights(still)[key])


@WITH_TORCH
def test_whom_the_start_knows_is_not_tested(source, trained, release, tmp_path):
    path = release / "splits" / "known.parquet"
    table = pq.read_table(release / "splits" / "default.parquet")
    parts = pa.array(["test", "train", "dev", "train", "train", "train"])
    pq.write_table(table.set_column(1, table.schema.field("split"), parts), path)
    with pytest.raises(BenchmarkError, match="lab/p0 is tested, and mlp-started starts from weights"):
        evaluate(source, lambda: quick("mlp", start=trained), TimeHistory("known"), tmp_path)
    path.unlink()


@WITH_TORCH
def test_a_start_is_one_training(trained):
    with pytest.raises(BenchmarkError, match="0 trainings of mlp-wide"):
        quick("mlp", features="wide", start=trained)


@WITH_TORCH
def test_wide_features_are_learnt_from(source, tmp_path):
    parts = source.parts("default", "test")
    wide = quick("mlp", features="wide", epochs=1)
    result = evaluate(source, lambda: wide, TimeHistory(), tmp_path)
    assert (result.name, wide.network.feature_mean.shape) == ("mlp-wide", (SIZES["wide"],))
    assert parts.test == {score.person_id for score in result.scores}
    assert average(result.scores, "coverage_95") is not None
