"""How far the fitted skeleton's markers lie from the measured ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.shoulder_markers import shoulder_markers, shrugged
from solver.runs import runs
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class MarkerErrors:
    """Distance of each model marker from the raw measured one [m], NaN where unseen."""

    names: tuple[str, ...]  # markers that model and recording share
    distance: Float[np.ndarray, "frames markers"]  # [m]

    @property
    def seen_share(self) -> Float[np.ndarray, " frames"]:
        """Share of the shared markers that each frame shows, 0 to 1."""
        return np.isfinite(self.distance).mean(axis=1)

    @property
    def rms(self) -> float:
        """Root mean square over all seen marker-frames [m]."""
        return float(np.sqrt(np.nanmean(self.distance**2)))

    @property
    def rms_per_frame(self) -> Float[np.ndarray, " frames"]:
        """Root mean square over the markers of each frame [m]; NaN on frames without any."""
        seen = np.isfinite(self.distance)
        squares = np.where(seen, self.distance, 0.0) ** 2
        with np.errstate(invalid="ignore"):
            return np.sqrt(squares.sum(axis=1) / seen.sum(axis=1))

    @property
    def maximum_per_frame(self) -> Float[np.ndarray, " frames"]:
        """Largest distance of each frame [m]; NaN on frames without any."""
        largest = np.where(np.isfinite(self.distance), self.distance, -np.inf).max(axis=1, initial=-np.inf)
        return np.where(np.isfinite(largest), largest, np.nan)

    @property
    def rms_frame_mean(self) -> float:
        """Mean over frames of the per-frame RMS, as peers print it [m]."""
        return float(np.nanmean(self.rms_per_frame))

    @property
    def maximum(self) -> float:
        """Largest distance of all marker-frames [m]."""
        return float(np.nanmax(self.distance))


def marker_errors(
    skeleton: Skeleton,
    names: Sequence[str],
    model_ground: Float[np.ndarray, "frames markers 3"],
    measured_ground: Float[np.ndarray, "frames markers 3"],
    settings: KinematicsSettings,
) -> tuple[MarkerErrors, tuple[str, ...]]:
    """Distances of every shared marker, and a note on each that looks slipped, swapped or mislabelled.

    Args:
        skeleton: the fitted one.
        names: of the shared markers, the model's.
        model_ground: of the fitted skeleton [m], y up.
        measured_ground: as recorded, NaN where unseen [m].
        settings: from which distance on a marker is suspect.
    """
    distance = np.linalg.norm(model_ground - measured_ground, axis=2)
    suspect = distance > settings.robust_scale_m
    on_shoulders = shoulder_markers(skeleton) if suspect.any() else frozenset()
    shoulders = [i for i, name in enumerate(names) if name in on_shoulders]
    notes = []
    for i in np.flatnonzero(suspect.any(axis=0)).tolist():
        name, far = names[i], suspect[:, i]
        stretches = ", ".join(f"{start}-{end - 1}" for start, end in runs(far))
        why = "slipped, swapped or mislabelled?"
        if i in shoulders and shrugged(i, shoulders, model_ground[far], measured_ground[far]):
            why = "the shoulder rose? The model has no shoulder girdle."
        notes.append(
            f"marker {name} is up to {100 * np.nanmax(distance[:, i]):.0f} cm off in frames {stretches}: "
            f"{why} It had little weight there"
        )
    return MarkerErrors(tuple(names), distance), tuple(notes)
