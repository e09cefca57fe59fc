import numpy as np

from solver.dynamics.heldout import withheld_frames
from solver.dynamics.trajectory_settings import TrajectorySettings

SETTINGS = TrajectorySettings(heldout_block_s=0.2, heldout_every=3)


def test_blocks_of_known_frames_never_at_the_ends():
    counts = np.ones(200, dtype=bool)
    counts[60:90] = False
    withheld = withheld_frames(counts, 100.0, SETTINGS)
    assert not withheld[~counts].any()
    assert not withheld[:20].any()
    assert not withheld[-20:].any()
    assert 0.2 < withheld.sum() / counts.sum() < 0.45
    edges = np.flatnonzero(np.diff(withheld[:60].astype(int)))
    assert np.diff(edges)[0] == 20


def test_too_few_frames_withhold_nothing():
    assert not withheld_frames(np.ones(30, dtype=bool), 100.0, SETTINGS).any()
