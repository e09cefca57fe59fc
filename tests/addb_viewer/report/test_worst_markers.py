"""The markers to look at first."""

import re
from dataclasses import replace

import numpy as np

from addb_viewer.report.quality import seek_link, worst_markers


def test_markers_in_the_order_of_their_error(recording):
    replay = recording.trials[0].replay
    rms = np.sqrt(np.nanmean(replay.markers.errors**2, axis=0))
    page = worst_markers(replay, 2)
    assert re.findall(r">(M\d)<", page) == [f"M{i}" for i in np.argsort(-rms)]
    worst = int(np.argmax(rms))
    frame = int(np.nanargmax(replay.markers.errors[:, worst]))
    assert f'data-seek="2:{frame}"' in page
    assert f"{100 * rms[worst]:.2f} cm" in page
    assert "85\u00a0%" in page  # M2 is lost on 6 of 40 frames


def test_an_error_beyond_the_bound_is_marked(recording):
    replay = recording.trials[0].replay
    model = replay.markers.model.copy()
    model[7, 4] += 0.5
    page = worst_markers(replace(replay, markers=replace(replay.markers, model=model)), 0)
    assert page.count("✗") == 1
    assert page.index("M4") < page.index("✗")


def test_nothing_to_compare(recording):
    replay = recording.trials[0].replay
    markers = replace(replay.markers, model=replay.markers.model * np.nan)
    assert worst_markers(replace(replay, markers=markers), 0) == (
        "<p>No marker of this trial is in the model.</p>"
    )


def test_links_lead_to_the_scene():
    assert seek_link(1, 20, "<20>") == '<a href="#scene" data-seek="1:20">&lt;20&gt;</a>'
