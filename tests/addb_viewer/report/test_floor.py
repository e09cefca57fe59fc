"""What lies on the floor."""

from dataclasses import replace

import numpy as np

from addb_viewer.report.floor import grid, plates_of, walked_floor


def test_a_grid_covers_its_corners_in_half_metres():
    lines = grid(np.array([-0.2, 0.1]), np.array([0.9, 0.7]))
    assert (lines[..., 1] == 0).all()
    assert lines[..., 0].min() == -0.5
    assert lines[..., 0].max() == 1.0
    assert sorted({float(a[0]) for a, b in lines if a[0] == b[0]}) == [-0.5, 0.0, 0.5, 1.0]
    assert sorted({float(a[2]) for a, b in lines if a[2] == b[2]}) == [0.0, 0.5, 1.0]


def test_the_floor_reaches_beyond_all_that_was_seen(recording):
    replay = recording.trials[0].replay
    lines, seen = walked_floor(replay), replay.markers.measured
    for axis in (0, 2):
        assert lines[..., axis].min() <= np.nanmin(seen[..., axis]) - 1.0
        assert lines[..., axis].max() >= np.nanmax(seen[..., axis]) + 1.0
    unseen = replace(replay, markers=replace(replay.markers, measured=seen * np.nan))
    assert len(walked_floor(unseen)) == 0


def test_plates_have_an_outline_or_at_least_a_trace(recording):
    replay = recording.trials[0].replay
    first, _ = plates_of(replay)
    np.testing.assert_array_equal(first.outline, replay.plates[0].corners[[0, 1, 2, 3, 0]])
    bare = replace(replay, plates=(replace(replay.plates[0], corners=None),))
    (only,) = plates_of(bare)
    assert len(only.outline) == 0
    loaded = replay.plates[0].force[:, 1] > 100
    np.testing.assert_array_equal(only.trace, replay.plates[0].cop[loaded])
