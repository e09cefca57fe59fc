"""What was recorded."""

from dataclasses import replace

import numpy as np

from addb_viewer.report.made_from import recorded, segment_masses
from solver.dynamics.dynamics import MassStd


def test_person_and_trials(recording):
    page = recorded(recording)
    assert "40.0\u00a0kg fitted (40.0\u00a0kg entered)" in page
    assert "1.60\u00a0m (not entered)" in page
    assert "2 bodies, 7 degrees of freedom" in page
    assert "40 frames, 0.80\u00a0s at 50\u00a0Hz" in page
    assert "0.trc" in page


def test_a_segment_whose_band_is_as_wide_as_that_of_tables_is_not_told(recording):
    (first, second), fit = recording.fit.skeleton.bodies, recording.fit
    mass = np.array([first.mass, second.mass])
    off = MassStd(1.0, mass * [0.02, 0.0601], mass * [0.04, 0.06])
    assert segment_masses(fit, off) == (
        f"{first.name} {first.mass:.1f} kg ± 4 % (by tables 8 %); masses of other segments are not told by "
        "this recording"
    )
    assert segment_masses(fit, replace(off, segments_kg=off.untold_kg)).startswith(
        "masses of segments are not"
    )


def test_how_much_was_seen_and_loaded(recording):
    page = recorded(recording)
    assert "97.5\u00a0%" in page  # 6 of 240 marker-frames are lost
    assert "plate 1 0.4\u00a0s, plate 2 0.3\u00a0s" in page  # its own clock: before 0.4 s, and after 0.5 s


def test_a_trial_without_plates(small_fit):
    from addb_viewer.trial_view.recorded_subject import recording_of

    assert "<td>none</td>" in recorded(recording_of(small_fit))
