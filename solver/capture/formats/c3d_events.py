"""Foot strikes and foot-offs that a laboratory stored in a C3D file."""

import numpy as np
from jaxtyping import Float

from solver.capture.capture import FootEvent, FootEventLabel, Side
from solver.capture.formats.c3d_contents import C3dContents

SIDES: dict[str, Side] = {"left": "Left", "right": "Right"}
LABELS: dict[str, FootEventLabel] = {"foot strike": "Foot Strike", "foot off": "Foot Off"}


def foot_events(contents: C3dContents) -> tuple[tuple[FootEvent, ...], list[str]]:
    """Foot strikes and foot-offs in order of time, and names of other events; the first frame is at 0 s."""
    labels, contexts = contents.words("EVENT", "LABELS"), contents.words("EVENT", "CONTEXTS")
    times = _minutes_and_seconds(contents)
    begin_s = contents.first_frame / contents.rate
    found: list[FootEvent] = []
    others: list[str] = []
    for k in range(min(len(labels), times.shape[1])):
        side = SIDES.get(contexts[k].lower() if k < len(contexts) else "", "General")
        label = LABELS.get(labels[k].lower())
        if label is None:
            others.append(labels[k])
        else:
            found.append(FootEvent(float(60 * times[0, k] + times[1, k] - begin_s), side, label))
    return tuple(sorted(found, key=lambda event: event.time_s)), others


def _minutes_and_seconds(contents: C3dContents) -> Float[np.ndarray, "2 events"]:
    """Of all events, those of TIMES2 and so on behind the first 255."""
    found = [contents.array("EVENT", "TIMES")]
    while len(more := contents.array("EVENT", f"TIMES{len(found) + 1}")):
        found.append(more)
    return np.hstack([times for times in found if times.ndim == 2] or [np.zeros((2, 0))])
