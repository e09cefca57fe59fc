"""A contact's force over time is the force that its signature adds to the balance, where it acts."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Range, in_view
from solver.diagnosis.causes.external_contact import ExternalContact
from solver.diagnosis.causes.forces_on_trunk import BodyWeightSupport
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.causes.time_history import stretch_of
from solver.diagnosis.diagnosis_report import TIME_HISTORY_DIGITS
from solver.diagnosis.force_histories import STEP_S, force_histories


@pytest.fixture
def contact(short_scene):
    windows = (stretch_of(short_scene, 20, 50), stretch_of(short_scene, 90, 120))
    return ExternalContact("torso", windows, (60.0, 60.0))


def test_every_window_has_its_time_history(short_scene, contact):
    signature = contact.signature(short_scene, ())
    x = np.random.default_rng(0).normal(size=signature.columns.shape[2])
    time_histories = force_histories(contact, [short_scene], (), x)
    touching = contact.frames([short_scene], (), x)
    assert [(c.trial, c.start, c.step) for c in time_histories] == [(r.trial, r.start, 2) for r in touching]
    force = np.einsum("tci,i->tc", signature.columns, x)[:, :3]
    for time_history, touched in zip(time_histories, touching, strict=True):
        assert time_history.step / short_scene.rate == pytest.approx(STEP_S)
        own = force[touched.start : touched.end : 2].round(TIME_HISTORY_DIGITS)
        np.testing.assert_allclose(time_history.force_N, own, atol=1e-9)


def test_nothing_is_told_of_frames_that_show_nobody(short_scene, contact):
    signature = contact.signature(short_scene, ())
    x = np.ones(signature.columns.shape[2])
    observed = short_scene.markers.observed_ground.copy()
    observed[:30], observed[100:] = np.nan, np.nan
    scene = replace(short_scene, markers=replace(short_scene.markers, observed_ground=observed))
    (first, last), all_along = contact.frames([scene], (), x), Range(scene.name, 0, scene.frames)
    assert first.start < 30 < first.end < last.start < 100 < last.end
    cut = (Range(scene.name, 30, first.end), Range(scene.name, last.start, 100))
    assert in_view((first, last, all_along), [scene]) == (*cut, all_along)
    assert in_view([Range(scene.name, 110, 120)], [scene]) == ()
    time_histories = force_histories(contact, [scene], (), x)
    assert [(c.start, len(c.force_N)) for c in time_histories] == [
        (one.start, len(range(one.start, one.end, 2))) for one in cut
    ]


def test_what_acts_all_along_or_on_no_segment_has_none(short_scene):
    assert force_histories(PlateGain("plate_1"), [short_scene], (), np.ones(1)) == ()
    lift = BodyWeightSupport("torso")
    width = lift.signature(short_scene, ()).columns.shape[2]
    assert force_histories(lift, [short_scene], (), np.ones(width)) == ()
