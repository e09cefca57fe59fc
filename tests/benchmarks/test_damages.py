"""Damage by chance: what is fitted is a person, and nothing crashes."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from addb_viewer.api.recording import Recording
from addb_viewer.api.subject_fit import Fit
from benchmarks.damages import EDITORS, Damage, case, cut, damaged, fitted, moved_far_from
from tests.demo_walk import demo_walk


@cache
def walk() -> tuple[Recording, Fit]:
    """A second of the demo's walk, and its fit; no fixture, which hypothesis would print."""
    recording = cut(demo_walk().recording("walk"), 1.0)
    return recording, fitted(recording).fit()


@pytest.mark.slow
@settings(max_examples=2, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 10**9))
def test_damage_by_chance_neither_crashes_nor_makes_a_monster(seed):
    found = case("demo", *walk(), seed)
    assert found.outcome in ("fitted", "refused"), found.sentence
    assert not found.faults


@given(seed=st.integers(0, 10**9))
@settings(max_examples=50, deadline=None)
def test_nothing_outside_the_damage_is_touched(seed):
    recording, _ = walk()
    harmed, damages = damaged(recording, seed)
    whole = np.zeros(len(recording.times), dtype=bool)
    for damage in damages:
        whole[damage.start : damage.end] = True
    np.testing.assert_array_equal(harmed.markers[~whole], recording.markers[~whole])
    assert damaged(recording, seed)[1] == damages


@pytest.mark.parametrize("edit", EDITORS)
def test_each_damage_changes_something(edit):
    recording, _ = walk()
    random = np.random.default_rng(0)
    differ = []
    for _ in range(20):
        harmed, _ = edit(recording, random)
        same_markers = np.array_equal(harmed.markers, recording.markers, equal_nan=True)
        same_plates = all(
            np.array_equal(a.force, b.force, equal_nan=True)
            and np.array_equal(a.moment, b.moment, equal_nan=True)
            for a, b in zip(harmed.plates, recording.plates, strict=True)
        )
        differ.append(not (same_markers and same_plates))
    assert any(differ)


def test_what_is_far_is_compared_only_far_from_the_damage():
    recording, fit = walk()
    frames = len(recording.times)
    assert moved_far_from([Damage("removed", (), 0, frames)], fit, fit, frames) is None
    assert moved_far_from([Damage("removed", (), 0, 1)], fit, fit, frames) == 0.0
