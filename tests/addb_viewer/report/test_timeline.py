"""Charts and lanes of a trial."""

import re
from dataclasses import replace

import numpy as np

from addb_viewer.report.timeline import diagnosed_timeline, timeline


def test_residuals_markers_forces_and_lanes(report):
    (record,) = report.recording.trials
    page = timeline(record, 3, report.recording.diagnosis)
    for said in ("Residual force [N]", "Residual moment [N·m]", "Marker error [cm]", "Vertical force [N]"):
        assert said in page
    for said in ("contact R", "missing R", "usable", "cause 1", "this fit", "markers alone", "bound 0.05 BW"):
        assert said in page
    assert 'data-trial="3"' in page
    assert "not over a plate, frames 30–35" in page


def test_curves_of_residuals_have_a_gap_where_they_do_not_count(report):
    (record,) = report.recording.trials
    page = timeline(record, 0, None)
    first = page[: page.index("Residual moment")]
    own = next(path for path in re.findall("<path d='([^']*)'", first) if path.count("M") == 2)
    assert own.count(" ") >= 30


def test_markers_alone_run_off_the_axis_where_they_would_dwarf_this_fit(report):
    (record,) = report.recording.trials
    assert "▲" not in timeline(tamed(record, 1.0), 0, None)
    assert "▲ 1000" in timeline(tamed(record, 1000.0), 0, None)


def tamed(record, before):
    """The trial with a residual of 1 N and 1 N·m, and `before` times that before."""

    def of(replay, size):
        sizes = {name: np.full((40, 3), size / 3**0.5) for name in ("force", "moment")}
        return replace(replay, residual=replace(replay.residual, **sizes))

    return replace(record, replay=of(record.replay, 1.0), before=of(record.replay, before))


def test_the_diagnosed_residual_where_there_is_one(report, diagnosis):
    (record,) = report.recording.trials
    page = diagnosed_timeline(record, 0, diagnosis)
    assert "with causes" in page
    assert "ordinary" in page
    other = replace(record, replay=replace(record.replay, name="run"))
    assert diagnosed_timeline(other, 0, diagnosis) is None


def test_a_trial_without_anything_to_draw_still_has_its_lanes(report):
    (record,) = report.recording.trials
    bare = replace(record, replay=replace(record.replay, residual=None, plates=()), before=None)
    page = timeline(bare, 0, None)
    assert "Residual" not in page
    assert "contact R" in page
