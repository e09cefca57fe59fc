"""Which frames count, and why not the others."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.report.frames_kept import (
    MEANINGS,
    NO_FORCES,
    TRIAL_ENDS,
    decided_by,
    duration_s,
    frames_words,
    in_all,
    kept_frames,
    seconds_words,
)
from annotations.reasons import FORCE_COUNTS, REASONS
from solver.contact import mask
from solver.contact.contact_phases import ContactPhase
from solver.contact.wrenches import NOBODY, RECORDING, SOURCES


@pytest.fixture
def replay(recording):
    return recording.trials[0].replay


def with_forces(replay, **changes):
    return replace(replay, forces=replace(replay.forces, **changes))


def test_frames_and_their_cause(replay):
    kept = kept_frames(replay)
    assert (kept.count, kept.frames, kept.ranges) == (34, 40, ((0, 30), (36, 40)))
    (cause,) = kept.causes
    assert (cause.foot, cause.reason, cause.ranges) == ("calcn_r", "notOverForcePlate", ((30, 36),))
    assert (cause.frames, cause.foot_words, cause.words) == (6, "right foot", "not over a plate")
    assert cause.meaning == "The foot stands where no plate is."


@pytest.mark.parametrize(
    "missing", [(), ((30, 36, None, "hasNoForcePlateData"),), ((0, 39, "calcn_r", "a"),)]
)
@pytest.mark.parametrize("ends", [0, 2])
def test_every_force_counts_only_where_no_frame_is_left_out(replay, missing, ends):
    used = np.ones(40, dtype=bool)
    used[:ends] = False
    for start, end, _, _ in missing:
        used[start:end] = False
    kept = kept_frames(
        with_forces(replace(replay, residual=replace(replay.residual, used=used)), missing=missing)
    )
    said = decided_by(NOBODY, kept)
    assert said.startswith("nobody")
    assert ("every recorded force counts" in said) == (not kept.causes)


def test_every_frame_that_does_not_count_has_a_cause(replay):
    used = replay.residual.used.copy()
    used[:3] = False
    used[38:] = False
    missing = ((30, 36, "calcn_r", "a"), (33, 39, None, "b"), (5, 6, "calcn_r", "a"))
    used[33:39] = used[5] = False
    kept = kept_frames(
        with_forces(replace(replay, residual=replace(replay.residual, used=used)), missing=missing)
    )
    explained = np.zeros(40, dtype=bool)
    for cause in kept.causes:
        for start, end in cause.ranges:
            explained[start:end] = True
    np.testing.assert_array_equal(explained, ~used)
    found = {(cause.foot, cause.reason): cause.ranges for cause in kept.causes}
    assert found["calcn_r", "a"] == ((5, 6), (30, 36))
    assert found[None, TRIAL_ENDS] == ((0, 3), (39, 40))
    assert [cause.frames for cause in kept.causes] == sorted(
        (cause.frames for cause in kept.causes), reverse=True
    )


def test_a_trial_without_forces_has_no_usable_frame(replay):
    kept = kept_frames(replace(replay, residual=None))
    assert kept.count == 0
    assert [(cause.reason, cause.frames) for cause in kept.causes] == [(NO_FORCES, 40)]


def test_contacts_on_plates_are_counted(replay):
    phases = (ContactPhase(0, 0, 9, 1.0), ContactPhase(0, 12, 20, 0.1), ContactPhase(0, 30, 40, 0.6))
    assert kept_frames(with_forces(replay, contacts=phases)).contacts == (2, 3)
    assert kept_frames(with_forces(replay, contacts=())).contacts is None


def test_every_reason_that_there_is_has_a_sentence():
    own = {v for k, v in vars(mask).items() if k.isupper() and isinstance(v, str)}
    own -= {*SOURCES, RECORDING}  # who says so, not why
    assert own | set(REASONS) - {FORCE_COUNTS} <= set(MEANINGS)
    assert all(sentence.endswith(".") for sentence in MEANINGS.values())


def test_ranges_in_words():
    times = 2.0 + np.arange(10) / 50
    assert (frames_words(3, 7), frames_words(3, 4)) == ("3–6", "3")
    assert (seconds_words(3, 7, times), seconds_words(3, 4, times)) == ("2.06–2.12 s", "2.06 s")
    assert duration_s([(0, 5), (7, 12)], 50.0) == pytest.approx(0.2)


def test_several_trials_in_all(replay):
    assert in_all([kept_frames(replay), kept_frames(replace(replay, residual=None))]) == (34, 80)
