"""A walk recorded 25 ms late, solved with the accepted clock from the start and after an edit."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import FitError
from solver.common.progress import silent
from solver.diagnosis.accepted_causes import extension_for
from solver.fitting.held_out_stage import predict_held_out
from solver.fitting.pipeline import can_resolve, resolve, solve
from solver.fitting.provenance import other_recordings, provenance_of
from solver.fitting.settings import Settings
from solver.simulate.subject_folder import write_subject
from tests.flagged import flagged
from tests.measured_walk import WOMAN, measured_walk

pytestmark = pytest.mark.slow  # their fixtures take long

LATE_S = 0.025
CLOCK = {("clock_offset", "all"): ()}
SETTINGS = Settings()


@pytest.fixture(scope="module")
def subject(tmp_path_factory):
    folder = tmp_path_factory.mktemp("late")
    write_subject(folder, WOMAN, [measured_walk(force_delay_s=LATE_S)])
    return open_subject(folder)


@pytest.fixture(scope="module")
def extension(subject):
    return extension_for(subject, SETTINGS, CLOCK).extension


@pytest.fixture(scope="module")
def plain(subject):
    return solve(subject, SETTINGS)


@pytest.fixture(scope="module")
def extended(subject, extension):
    return solve(subject, SETTINGS, extension=extension)


def rms(values):
    return float(np.sqrt((values**2).sum(axis=1).mean()))


def test_the_named_cause_is_found_again(extension):
    (cause,) = extension.causes
    assert cause.parameters["offset_s"][0] == pytest.approx(LATE_S, rel=0.1)


def test_a_cause_that_is_not_there_is_refused(subject):
    with pytest.raises(FitError, match=r"plate_gain \(plate_9\)"):
        extension_for(subject, SETTINGS, CLOCK | {("plate_gain", "plate_9"): ()})


def test_the_solve_obeys_the_extended_forces(plain, extended):
    one, other = plain.trials[0], extended.trials[0]
    used = one.dynamics.used & other.dynamics.used
    assert rms(other.dynamics.residual_root[used, :3]) < rms(one.dynamics.residual_root[used, :3])
    blocks = one.held_out.frames & other.held_out.frames
    for axes in (slice(0, 3), slice(3, 6)):
        assert rms(other.held_out.residual_root[blocks, axes]) < rms(one.held_out.residual_root[blocks, axes])


def test_the_fit_says_that_it_is_extended(subject, extension, plain, extended):
    assert any("clock_offset (all)" in note for note in extended.notes)
    assert not any("clock_offset" in note for note in plain.notes)
    assert extended.provenance == provenance_of(subject, subject.trials, {}, extension)
    assert extended.provenance != plain.provenance
    assert other_recordings(extended.provenance, plain.provenance) == []
    heavier = provenance_of(replace(subject, mass_kg=90.0), subject.trials)
    assert other_recordings(plain.provenance, heavier) == ["mass_kg"]


def test_a_resolve_goes_on_with_the_same_extension(subject, extension, extended):
    assert can_resolve(extended, subject, subject.trials, SETTINGS, extension=extension)
    assert not can_resolve(extended, subject, subject.trials, SETTINGS)
    reviews = {"walk": flagged((90, 110, None, "manualReview"))}
    ours = predict_held_out(
        resolve(extended, reviews, SETTINGS, extension=extension), SETTINGS, silent, extension
    )
    cold = solve(subject, SETTINGS, reviews=reviews, extension=extension)
    assert ours.notes == cold.notes
    assert ours.provenance == cold.provenance
    one, other = ours.trials[0], cold.trials[0]
    used = one.dynamics.used
    np.testing.assert_array_equal(used, other.dynamics.used)
    assert not used[90:110].any()
    assert rms((one.dynamics.residual_root - other.dynamics.residual_root)[used, :3]) < 0.5
    assert np.abs((one.motion.q - other.motion.q)[used]).max() < 0.002
    change = (one.dynamics.joint_torques - other.dynamics.joint_torques)[90:110]
    assert np.sqrt((change**2).mean()) < 2.0


def test_torques_go_on_where_a_force_is_flagged(subject, extension, extended):
    """Beyond a border of flagged frames torques are told by the motion, extra wrench and all."""
    reviews = {"walk": flagged((100, 104, None, "manualReview"))}
    edited = resolve(extended, reviews, SETTINGS, extension=extension).trials[0]
    torques = edited.dynamics.joint_torques[:, 6:]
    own = np.abs(np.diff(extended.trials[0].dynamics.joint_torques[10:-10, 6:], axis=0)).max(axis=0)
    level = np.maximum(own, 0.1 * np.sqrt((own**2).mean()))
    for border in (100, 104):
        change = np.abs(np.diff(torques[border - 3 : border + 3], axis=0)).max(axis=0)
        assert np.all(change < 2.5 * level)
