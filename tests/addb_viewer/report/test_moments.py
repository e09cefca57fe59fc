"""Which frames are shown."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.report.frames_kept import kept_frames
from addb_viewer.report.motion_part import moments_of
from addb_viewer.trial_view.replay import RequiredForce


@pytest.fixture
def replay(recording):
    return recording.trials[0].replay


def shown(replay, diagnosis=None):
    return moments_of(replay, kept_frames(replay), diagnosis)


def test_what_was_left_out_the_largest_residual_and_a_usable_frame(replay):
    left_out, residual, usable = shown(replay)
    assert (left_out.heading, left_out.frame in range(30, 36)) == ("Left out", True)
    assert left_out.why.startswith("right foot: not over a plate.")
    of = replay.residual
    worst = np.fmax(
        np.linalg.norm(of.force, axis=1) / of.force_limit, np.linalg.norm(of.moment, axis=1) / of.moment_limit
    )
    assert residual.frame == np.argmax(np.where(of.used, worst, 0))
    assert f"{worst[residual.frame]:.1f} times the bound" in residual.why
    assert (usable.heading, usable.frame) == ("Usable", 14)


def test_the_left_out_frame_shows_a_force_that_nobody_measured(replay):
    force = np.full((40, 3), np.nan)
    force[30:36] = 0.0
    force[34] = [0.0, 300.0, 0.0]
    required = RequiredForce("calcn_r", force, np.zeros((40, 3)))
    left_out, *_ = shown(replace(replay, required=(required,)))
    assert left_out.frame == 34
    assert "300 N" in left_out.why


def test_no_picture_is_of_a_frame_that_shows_nobody(replay):
    position = replay.bodies.position.copy()
    position[30:34] = np.nan
    left_out, *_ = shown(replace(replay, bodies=replace(replay.bodies, position=position)))
    assert (left_out.heading, left_out.frame in (34, 35)) == ("Left out", True)
    position[30:36] = np.nan
    assert "Left out" not in [
        m.heading for m in shown(replace(replay, bodies=replace(replay.bodies, position=position)))
    ]


def test_a_named_force_takes_the_place_of_an_ordinary_frame(replay, effect, figures):
    contact = effect("external_contact", "pelvis", ((5, 9),), force_x_N=50.0, force_y_N=50.0, force_z_N=50.0)
    assert shown(replay, figures(contact))[-1].heading == "The named cause"


def test_without_forces_the_worst_marker_is_shown(replay):
    (only,) = shown(replace(replay, residual=None))
    assert only.heading == "Largest marker error"
    assert np.nanmax(replay.markers.errors[only.frame]) == np.nanmax(replay.markers.errors)


def test_a_trial_without_anything_has_no_picture(replay):
    markers = replace(replay.markers, model=replay.markers.model * np.nan)
    assert shown(replace(replay, residual=None, markers=markers)) == ()
