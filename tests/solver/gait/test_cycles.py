"""Means of the stances near in time, by which a belt's speed is known, against every stance at once."""

import numpy as np

from solver.gait.cycles import mean_nearby


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
