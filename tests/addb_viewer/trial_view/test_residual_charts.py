"""The residual of a trial as charts on the recording's own time."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.trial_view.residual_charts import residual_charts, worst_frame


def test_force_and_moment_lie_at_the_times_of_their_windows(make_replay, effect, figures):
    told, replay = figures(effect("clock_offset", "all", offset_s=0.01)), make_replay()
    force, moment = residual_charts(told, replay)
    assert (force.heading, moment.heading) == ("Residual force [N]", "Residual moment [N·m]")
    time_history = told.residual.trials[0].time_history
    for chart, names in (
        (force, ("force_N", "force_after_N", "force_floor_N")),
        (moment, ("moment_Nm", "moment_after_Nm", "moment_floor_Nm")),
    ):
        for line, name in zip(chart.lines, names, strict=True):
            for time, value in zip(time_history.time_s, getattr(time_history, name), strict=True):
                frame = round(time * replay.rate)
                if not chart.shaded[frame]:
                    assert line.values[frame] == pytest.approx(value)


def test_frames_that_did_not_count_are_shaded(make_replay, effect, figures):
    replay = make_replay()
    force, _ = residual_charts(figures(effect("clock_offset", "all", offset_s=0.01)), replay)
    time_s = replay.times - replay.times[0]
    assert force.shaded[(time_s > 1.02) & (time_s < 1.19)].all()
    assert force.shaded[time_s < 0.1 - 1e-9].all()
    assert not force.shaded[(time_s > 0.15) & (time_s < 0.95)].any()
    np.testing.assert_array_equal(np.isnan(force.lines[0].values), force.shaded)


def test_without_causes_there_is_no_after_and_elsewhere_nothing(make_replay, figures):
    force, _ = residual_charts(figures(verdict="clean"), make_replay())
    assert [line.label for line in force.lines] == ["recorded", "ordinary"]
    assert worst_frame(figures(), "walk") == 120
    assert residual_charts(figures(), make_replay("run")) == ()
    assert residual_charts(replace(figures(), residual=None), make_replay()) == ()
