"""Analog channels as the page draws them: every sample where it was taken."""

import numpy as np
import pytest

from addb_viewer.trial_view.analog_charts import MOST_SENT, analog_charts, analog_choices, channels_chosen
from solver.capture.formats.analog_channels import AnalogChannels

CHANNELS = (("VL", "V"), ("vertical force", ""))


def drawn(values, replay, unit="V"):
    (chart,) = analog_charts(AnalogChannels(("VL",), (unit,), values[:, None], 1000.0), replay).values()
    (line,) = chart["lines"]
    return chart, line, line["first"] + line["step"] * np.arange(len(line["values"]))


def test_channels_are_chosen_apart_from_curves_of_the_same_name():
    assert [choice["id"] for choice in analog_choices(CHANNELS)] == ["analog VL", "analog vertical force"]
    assert channels_chosen(["vertical force", "analog VL", "analog other"], CHANNELS) == ["VL"]


def test_a_sample_stands_at_the_frame_of_its_time_with_digits_enough(make_replay):
    values = 3e-5 * np.sin(0.03 * np.arange(4000.0))
    chart, line, frames = drawn(values, replay := make_replay())  # begins at 2 s
    np.testing.assert_allclose(replay.times[0] + frames / replay.rate, np.arange(4000) / 1000, atol=1e-9)
    np.testing.assert_allclose(line["values"], values, atol=1e-9)
    assert line["digits"] == 8
    assert chart["low"] < values.min() < values.max() < chart["high"] < 1.2 * values.max()


def test_the_axis_is_the_signals_own_and_what_does_not_change_has_one_too(make_replay):
    chart, _, _ = drawn(2.5 + 0.01 * np.sin(np.arange(400.0)), make_replay())
    assert 2.48 < chart["low"] < chart["high"] < 2.52
    level, line, _ = drawn(np.full(400, 5.0), make_replay())
    assert (level["low"], level["high"], line["digits"]) == (4.0, 6.0, 3)
    _, line, _ = drawn(np.array([np.nan, 1.0, np.nan]), make_replay())
    assert line["values"] == [None, 1.0, None]
    unknown, _, _ = drawn(np.full(3, np.nan), make_replay())
    assert (unknown["low"], unknown["high"]) == (-1.0, 1.0)


@pytest.mark.parametrize("samples", [MOST_SENT, MOST_SENT + 1, 1_200_000])
def test_of_a_very_long_one_the_lowest_and_highest_are_sent_and_it_says_so(samples, make_replay):
    values = np.random.default_rng(5).normal(size=samples)
    values[samples // 2] = 40.0
    _, line, frames = drawn(values, replay := make_replay())
    assert len(frames) <= MOST_SENT + 2
    assert (max(line["values"]), min(line["values"])) == (40.0, pytest.approx(values.min(), abs=1e-4))
    at_s = replay.times[0] + frames[int(np.argmax(line["values"]))] / replay.rate
    assert at_s == pytest.approx(samples / 2 / 1000, abs=0.025)
    expected = {MOST_SENT: "", MOST_SENT + 1: "lowest and highest of 3 samples"}
    assert line["label"] == expected.get(samples, "lowest and highest of 24 samples")
