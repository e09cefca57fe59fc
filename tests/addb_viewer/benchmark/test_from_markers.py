"""The entry that sees markers: they tell where noisy angles do not."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.benchmark.from_angles import FromAngles
from addb_viewer.benchmark.predictors import FromMarkers
from addb_viewer.benchmark.task import BenchmarkError, SeenMarkers
from solver.skeleton.forward import marker_positions
from tests.addb_viewer.benchmark.simulated_release import example


@pytest.fixture(scope="module")
def shown():
    """A walk with exact markers, in another order, and angles that have slow errors."""
    one = example("walk")
    where = marker_positions(one.seen.skeleton, one.seen.q)
    rng = np.random.default_rng(2)
    drift = np.cumsum(rng.standard_normal(one.seen.q.shape), axis=0) * 2e-3
    names = tuple(reversed(one.seen.skeleton.marker_names))
    markers = SeenMarkers((*names, "unknown"), np.concatenate([where[:, ::-1], where[:, :1]], axis=1))
    return one, replace(one.seen, q=one.seen.q + drift, markers=markers)


def test_markers_corrected_by_the_motion(shown):
    one, seen = shown
    with_markers, with_angles = FromMarkers().predict(seen), FromAngles().predict(seen)

    def missed(predicted):
        return np.linalg.norm(predicted.force - one.measured.force, axis=2)[20:-20].mean()

    assert missed(with_markers) < 0.8 * missed(with_angles)


def test_short_stretches_are_told_from_angles(shown):
    _, seen = shown
    few = replace(
        seen, q=seen.q[:4], markers=SeenMarkers(seen.markers.names, seen.markers.position_ground[:4])
    )
    np.testing.assert_array_equal(FromMarkers().predict(few).force, FromAngles().predict(few).force)


def test_without_markers_it_says_so(shown):
    _, seen = shown
    with pytest.raises(BenchmarkError, match="needs markers"):
        FromMarkers().predict(replace(seen, markers=None))
