"""Marker paths ready to be drawn: computed once a trial, shared by all browsers that show it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8

from addb_viewer.app.style.palette import UNSEEN, error_colors


@dataclass(frozen=True)
class MarkerTracks:
    """Markers that are seen on some frame, in single precision, as the page takes them."""

    model: Float[np.ndarray, "frames markers 3"]  # [m] NaN where the model has no such marker
    seen: Bool[np.ndarray, "frames markers"]
    held: Float[np.ndarray, "frames markers 3"]  # [m] lost markers stay where they were
    colors: UInt8[np.ndarray, "frames markers 3"]


def marker_tracks(
    measured: Float[np.ndarray, "frames markers 3"],
    model: Float[np.ndarray, "frames markers 3"],
    errors: Float[np.ndarray, "frames markers"],
) -> MarkerTracks:
    """Paths and colours of the markers.

    Args:
        measured: [m], NaN where unseen.
        model: [m], NaN where the model has no such marker.
        errors: distance between the two [m].
    """
    ever = np.isfinite(measured).all(axis=2).any(axis=0)
    shown = measured[:, ever]
    seen = np.isfinite(shown).all(axis=2)
    colors = error_colors(errors[:, ever])
    colors[~seen] = UNSEEN
    return MarkerTracks(model[:, ever].astype(np.float32), seen, held(shown, seen), colors)


def held(
    positions: Float[np.ndarray, "frames markers 3"], seen: Bool[np.ndarray, "frames markers"]
) -> Float[np.ndarray, "frames markers 3"]:
    """Lost markers stay where they were last seen, or, before that, where they will first be seen."""
    row = np.arange(len(positions))[:, None]
    last = np.maximum.accumulate(np.where(seen, row, -1), axis=0)
    source = np.where(last >= 0, last, seen.argmax(axis=0)[None, :])
    return np.take_along_axis(positions, source[:, :, None], axis=0).astype(np.float32)
