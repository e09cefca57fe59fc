"""Markers thrown off their paths for a frame or a few, and left where they were."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reading_settings.bench import captures
from solver.capture.capture import Markers
from solver.capture.marker_cleaning import MarkerCleaningSettings, clean_markers

SPIKES_M = (0.25, 0.6)
AWAY_M, AWAY_FRAMES = 1.5, 4
MOST_FRAMES = 400


@dataclass(frozen=True, eq=False)
class Thrown:
    """A recording in which some markers are."""

    person: str
    markers: Markers
    truth: tuple[tuple[int, ...], ...]  # of each marker: frames that are wrong

    def answers(self, settings: MarkerCleaningSettings) -> Sequence[object]:
        """Frames that are taken away."""
        cleaned, _ = clean_markers(self.markers, settings)
        kept = dict(zip(cleaned.names, np.isfinite(cleaned.positions_ground).all(axis=2).T, strict=True))
        seen = np.isfinite(self.markers.positions_ground).all(axis=2).T
        return tuple(
            tuple(np.flatnonzero(here & ~kept[name]).tolist()) if name in kept else ()
            for name, here in zip(self.markers.names, seen, strict=True)
        )


def thrown() -> Iterator[Thrown]:
    """Of every recording: each third marker has a spike, each third is elsewhere for some frames."""
    rng = np.random.default_rng(0)
    for person, capture, _ in captures():
        markers = capture.markers
        positions = markers.positions_ground[:MOST_FRAMES].copy()
        truth = []
        for k in range(len(markers.names)):
            whole = np.flatnonzero(np.isfinite(positions[:, k]).all(axis=1))
            wrong: tuple[int, ...] = ()
            if k % 3 < 2 and len(whole) == len(positions) and len(whole) > 3 * AWAY_FRAMES:
                at = int(rng.integers(AWAY_FRAMES, len(whole) - 2 * AWAY_FRAMES))
                wrong = (at,) if k % 3 == 0 else tuple(range(at, at + AWAY_FRAMES))
                way = rng.normal(size=3)
                size = float(rng.choice(SPIKES_M)) if k % 3 == 0 else AWAY_M
                positions[list(wrong), k] += size * way / np.linalg.norm(way)
            truth.append(wrong)
        yield Thrown(person, replace(markers, positions_ground=positions), tuple(truth))
