"""Which cycles count; means of the stances near in time, against every stance at once."""

import numpy as np
import pytest

from solver.gait.cycles import cycles_of, mean_nearby
from solver.gait.foot_motion import FootMotion
from solver.gait.gait_events import Source, Stance


def test_stances_far_away_weigh_nothing_and_the_nearest_counts_where_none_is_near():
    rng = np.random.default_rng(4)
    at = np.concatenate([rng.uniform(0, 100, 150), rng.uniform(400, 420, 20)])  # nobody steps for minutes
    values = rng.normal(1.2, 0.1, (170, 2))
    for times in (np.arange(30, 40, 0.01), np.arange(0, 420, 0.5)):
        found = mean_nearby(times, at, values, 0.5)
        for k in range(0, len(times), 37):
            gap = np.abs(times[k] - at) / 0.5
            weight = np.exp((gap.min() ** 2 - gap**2) / 2)
            np.testing.assert_allclose(found[k], weight @ values / weight.sum(), rtol=1e-12)
    assert np.isfinite(mean_nearby(np.array([200.0, 300.0]), at, values, 0.5)).all()


@pytest.mark.parametrize(("progress_m_s", "count"), [(0.0, 0), (0.15, 0), (0.25, 2), (1.2, 2)])
def test_who_gets_on_slowly_walks_and_who_moves_to_and_fro_does_not(progress_m_s, count):
    times = np.arange(0.0, 3.0, 0.01)
    still = np.zeros((len(times), 2))
    fast = np.ones(len(times))  # the pelvis, whichever way
    motion = FootMotion(times, still, still, fast, np.zeros((len(times), 2, 2)))
    stances = [Stance(0, t, t + 0.7, Source.FEET) for t in (0.2, 1.2, 2.2)]
    heel = np.column_stack([progress_m_s * np.round(times - 0.2), 0 * times, 0 * times])
    assert len(cycles_of(stances, motion, (heel,), times)) == count
