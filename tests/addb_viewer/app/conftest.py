"""Replays made by hand, without any solver."""

import numpy as np
import pytest
import trimesh

from addb_viewer.app.library import Library
from addb_viewer.app.replay import BodyReplay, MarkerReplay, PlateReplay, Replay, ResidualReplay
from solver.capture.capture import Subject


@pytest.fixture(scope="session")
def make_replay():
    return _replay


def _replay(name="walk", frames=200, rate=100.0, *, fitted=True, plates=2):
    """Someone gliding along x at 1 m/s over plates; marker 2 is lost on frames 50 to 59."""
    times = 2.0 + np.arange(frames) / rate
    x = np.arange(frames) / rate
    offsets = np.array([[0, 1.7, 0], [0, 1.0, 0.1], [0, 1.0, -0.1], [0.1, 0.05, 0.1], [0.1, 0.05, -0.1]])
    measured = offsets[None] + np.stack([x, 0 * x, 0 * x], axis=1)[:, None]
    measured[50:60, 2] = np.nan
    model = measured + np.array([0.03, 0.0, 0.0]) if fitted else np.full_like(measured, np.nan)
    model[:, 0] = np.nan
    position = np.stack([x, np.full(frames, 1.0), 0 * x], axis=1)[:, None]
    still = np.tile([1.0, 0, 0, 0], (frames, 1, 1))
    forward = np.tile([1.0, 0, 0], (frames, 1))
    return Replay(
        name=name,
        times=times,
        rate=rate,
        markers=MarkerReplay(("HEAD", "R", "L", "RTOE", "LTOE"), measured, model),
        plates=tuple(_plate(i, frames, x) for i in range(plates)),
        feet=("calcn_r", "calcn_l") if fitted else (),
        bodies=BodyReplay(("pelvis",), still, position, forward=forward) if fitted else None,
        residual=_residual(frames, position[:, 0]) if fitted else None,
        notes=("plate 2 was not tared",),
    )


def _plate(i, frames, x):
    force, cop = np.zeros((frames, 3)), np.full((frames, 3), np.nan)
    loaded = slice(i * 60, i * 60 + 60)
    force[loaded, 1] = 700.0
    cop[loaded] = np.stack([x[loaded], 0 * x[loaded], 0 * x[loaded] + 0.1], axis=1)
    foot = np.where(np.arange(frames) < 150, i % 2, -1)
    corners = np.array([[0, 0, -0.3], [0.6, 0, -0.3], [0.6, 0, 0.3], [0, 0, 0.3]])
    corners += np.array([0.6 * i, 0, 0])
    return PlateReplay(f"plate {i + 1}", force, cop, foot, corners)


def _residual(frames, com):
    force = np.zeros((frames, 3))
    force[:, 0] = np.linspace(0, 100, frames)
    return ResidualReplay(force, 0.1 * force, com, np.arange(frames) >= 20, 35.0, 12.0)


class HandMadeLibrary(Library):
    """A library that gives these replays."""

    def __init__(self, folder, replays):
        super().__init__(Subject(folder, ()), meshes={"pelvis": trimesh.creation.box((0.2, 0.2, 0.3))})
        self.replays = {replay.name: replay for replay in replays}
        self.broken = {}

    @property
    def trials(self):
        return (*self.replays, *self.broken)

    def replay(self, name):
        if name in self.broken:
            raise self.broken[name]
        return self.replays[name]


@pytest.fixture(scope="session")
def make_library():
    return HandMadeLibrary
