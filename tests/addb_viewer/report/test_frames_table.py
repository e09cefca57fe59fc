"""Usable frames as a table."""

from dataclasses import replace

import numpy as np

from addb_viewer.report.subject_page import frames_part
from solver.fitting.fit_result import StanceInfluence


def test_every_range_with_frames_and_seconds(report):
    (record,), (kept,) = report.recording.trials, report.kept
    page = frames_part(record, kept, 1)
    assert "34 of 40 frames are usable (0.68\u00a0s)." in page
    assert "Who decided: the review in this program." in page
    for seek, frames, seconds in (
        ("1:0", "0–29", "0.35–0.93"),
        ("1:36", "36–39", "1.07–1.13"),
        ("1:30", "30–35", "0.95–1.05"),
    ):
        assert f'data-seek="{seek}">{frames}</a> <small>{seconds}\u00a0s</small>' in page
    assert "left out: not over a plate<small>The foot stands where no plate is.</small>" in page


def test_a_trial_without_a_usable_frame(small_fit):
    from addb_viewer.report.frames_kept import kept_frames
    from addb_viewer.trial_view.recorded_subject import recording_of

    (record,) = recording_of(small_fit, trials=["no/forces"]).trials
    page = frames_part(record, kept_frames(record.replay), 0)
    assert "0 of 4 frames are usable" in page
    assert "nowhere" in page


def test_a_torque_that_rests_on_the_force_of_another_stance(report):
    (record,), (kept,) = report.recording.trials, report.kept
    change = np.zeros((40, 1))
    bold = StanceInfluence("walk", "calcn_r", (4, 20), change, "hip_flexion_l", 30, -21.0, 5.0)
    within = replace(bold, foot="calcn_l", frames=(18, 36), change=9.0)
    page = frames_part(record, kept, 1, [bold, within])
    assert 'The left hip flexion torque at <a href="#scene" data-seek="1:30">' in page
    assert "rests on the right stance of frames" in page
    assert "without its force it would differ by 21\u00a0N·m; its band is ± 10\u00a0N·m." in page
    assert "left stance" not in page
