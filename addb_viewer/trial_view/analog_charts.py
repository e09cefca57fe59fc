"""Analog channels that are no force plate's, as the page draws them: raw, in the file's units."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from addb_viewer.trial_view.palette import BLUE
from addb_viewer.trial_view.replay import Replay
from solver.capture.formats.analog_channels import AnalogChannels

PREFIX = "analog "  # of the ids of what can be chosen
ALSO = "analog channel emg sensor trigger"  # words by which people look for it
MOST_SENT = 100_000  # numbers of a curve: 50 s at 2000 Hz
MOST_DIGITS = 9  # behind the point
AIR = 0.06  # of the range, beyond the outermost value


def analog_choices(channels: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    """What can be chosen.

    Args:
        channels: name and unit of each.
    """
    return [{"id": f"{PREFIX}{name}", "words": name, "unit": unit, "also": ALSO} for name, unit in channels]


def channels_chosen(chosen: Sequence[str], channels: Sequence[tuple[str, str]]) -> list[str]:
    """Names of the channels among ids of all kinds."""
    return [name for name, _ in channels if f"{PREFIX}{name}" in chosen]


def analog_charts(analog: AnalogChannels, replay: Replay) -> dict[str, dict[str, Any]]:
    """A chart for each channel, by its id; of a very long one the lowest and highest of some samples.

    Args:
        analog: those that are shown.
        replay: the trial, on whose frames they are drawn.
    """
    start = (analog.start_time - float(replay.times[0])) * replay.rate
    return {
        f"{PREFIX}{name}": _chart(name, unit, values, replay.rate / analog.rate, start)
        for name, unit, values in zip(analog.names, analog.units, analog.values.T, strict=True)
    }


def _chart(
    name: str, unit: str, values: Float[np.ndarray, " samples"], step: float, first: float
) -> dict[str, Any]:
    """In the shape of `charts_json`; step: frames that a sample lasts, first: the first one's frame."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    air = AIR * (high - low) or 1.0
    drawn, each = _thinned(values)
    digits = min(max(3 - int(np.floor(np.log10(high - low or 1.0))), 0), MOST_DIGITS)
    numbers = np.round(drawn, digits + 2).astype(object)
    numbers[~np.isfinite(drawn)] = None
    label = f"lowest and highest of {round(2 * each)} samples" if each > 1 else ""
    return {
        "id": f"{PREFIX}{name}",
        "title": name,
        "unit": unit,
        "low": low - air,
        "high": high + air,
        "shaded": [],
        "peaks": [],
        "lines": [
            {
                "label": label,
                "short": label,
                "color": BLUE.on_any_page,
                "ink": BLUE.as_text,
                "values": numbers.tolist(),
                "step": each * step,
                "first": first,
                "digits": digits,
                "band": None,
                "style": "",
                "trial": "",
            }
        ],
    }


def _thinned(values: Float[np.ndarray, " samples"]) -> tuple[Float[np.ndarray, " values"], float]:
    """What is sent, and how many samples each number of it stands for."""
    if len(values) <= MOST_SENT:
        return values, 1.0
    each = -(-2 * len(values) // MOST_SENT)
    rows = np.pad(values, (0, -len(values) % each), mode="edge").reshape(-1, each)
    return np.stack([rows.min(axis=1), rows.max(axis=1)], axis=1).ravel(), each / 2
