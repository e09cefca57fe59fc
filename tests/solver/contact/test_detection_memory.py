"""A recorded walk, repeated to make long trials of it: what detection holds in memory at once."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from solver.contact.detection import detect
from solver.contact.detection_settings import DetectionSettings
from solver.kinematics.motion import Motion
from tests.conftest import MARKERS_ALONE

pytestmark = pytest.mark.real


def peak_MB(fit, times):
    """Of the trial forth and back so many times: its motion and its forces jump nowhere."""
    trial = fit.trials[0]
    once = np.arange(trial.motion.frames)
    order = np.concatenate([once if i % 2 == 0 else once[::-1] for i in range(times)])
    contacts = {
        name: getattr(trial.contacts, name)[order]
        for name in ("wrench_ground", "cop_ground", "observed", "in_contact", "plate", "wrench_raw_ground")
    }
    motion = Motion(trial.motion.dofs, trial.motion.q[order], trial.motion.rate, 0.0)
    forces = replace(trial.contacts, **contacts, unassigned=None)
    tracemalloc.start()
    try:
        detect(fit.skeleton, motion, forces, (), settings=DetectionSettings())
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_twice_as_long_takes_twice_the_memory(recorded_fit):
    walk = recorded_fit("walk_treadmill_stepwidth", MARKERS_ALONE)  # nine contacts on a treadmill
    once, twice = peak_MB(walk, 12), peak_MB(walk, 24)
    assert twice < 2.2 * once, f"{once:.0f} MB, then {twice:.0f} MB"
