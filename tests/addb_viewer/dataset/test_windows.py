"""Windows of a release against a slow search, and in PyTorch's own loader."""

import importlib.util

import numpy as np
import pytest

import addb_viewer.dataset
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.windows import Windows

SEEN, WANTED = ["q_hip_flexion_r", "q_knee_angle_r"], ["grf_r_y_N", "tau_knee_angle_r"]


@pytest.fixture(scope="module")
def opened(release):
    return addb_viewer.dataset.open(release)


def slowly(opened, frames, hop):
    """Last (trial, frame) of every window, row by row."""
    found, run = [], []
    for row in opened.frames(["counts", *SEEN, *WANTED], counting=False).to_pylist():
        place = row["trial_id"], row["segment"], row["frame"]
        fine = row["counts"] and all(row[name] is not None for name in (*SEEN, *WANTED))
        goes_on = run and run[-1][:2] == place[:2] and run[-1][2] + 1 == place[2]
        run = [*(run if goes_on else []), place] if fine else []
        if len(run) >= frames and (len(run) - frames) % hop == 0:
            found.append((place[0], place[2]))
    return found


@pytest.mark.parametrize(("frames", "hop"), [(20, 1), (12, 7)])
def test_windows_are_those_of_a_slow_search(opened, frames, hop):
    windows = Windows(opened, SEEN, WANTED, frames=frames, hop=hop)
    ends = [(windows.trial_id[row], int(windows.frame[row])) for row in windows.last]
    assert ends == slowly(opened, frames, hop)
    assert len(windows) == len(ends)


def test_a_window_has_every_fifth_frame_up_to_the_last_and_what_is_wanted_there(opened):
    windows = Windows(opened, SEEN, WANTED, frames=20)
    seen, wanted = windows[len(windows) // 2]
    row = windows.last[len(windows) // 2]
    trial, last = windows.trial_id[row], int(windows.frame[row])
    table = opened.frames([*SEEN, *WANTED], where={"trial_id": trial}).to_pylist()
    of_frame = {one["frame"]: one for one in table}
    frames = [last - back for back in range(15, -1, -5)]
    np.testing.assert_array_equal(seen, np.float32([[of_frame[f][n] for n in SEEN] for f in frames]))
    np.testing.assert_array_equal(wanted, np.float32([of_frame[last][n] for n in WANTED]))
    assert seen.dtype == wanted.dtype == np.float32


def test_what_cannot_be_is_said(opened):
    with pytest.raises(ReleaseError, match="no column 'grf_r_y'"):
        Windows(opened, SEEN, ["grf_r_y"])
    with pytest.raises(ReleaseError, match="no 5000 frames in a row"):
        Windows(opened, SEEN, WANTED, frames=5000)
    with pytest.raises(ReleaseError, match="1 or more"):
        Windows(opened, SEEN, WANTED, every=0)


@pytest.mark.skipif(importlib.util.find_spec("torch") is None, reason="PyTorch is not installed")
def test_pytorchs_loader_takes_them_as_they_are(opened):
    import torch

    windows = Windows(opened, SEEN, WANTED, frames=20)
    batches = list(torch.utils.data.DataLoader(windows, batch_size=16))
    assert sum(len(wanted) for _, wanted in batches) == len(windows)
    assert batches[0][0].shape == (16, 4, len(SEEN))
    np.testing.assert_array_equal(batches[0][0][3].numpy(), windows[3][0])
