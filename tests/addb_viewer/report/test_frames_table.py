"""Usable frames as a table."""

from addb_viewer.report.subject_page import frames_part


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
