"""Crossings of raw plates, found by a statement of their own."""

from dataclasses import dataclass

import numpy as np
import pytest

LEVEL_N, LEAST_PEAK_N, SHORTEST_S = 20.0, 150.0, 0.06


@dataclass(frozen=True)
class Measured:
    """A foot on plates; None where it stood before or goes on standing."""

    foot: int
    on_s: float | None
    off_s: float | None


def one_plate(plate, feet_ground, times):
    """Loads above 20 N, to a fraction of a sample; the foot whose middle is nearest to the pressure."""
    load = np.nan_to_num(plate.force_ground[:, 1])
    above = np.concatenate([[False], load > LEVEL_N, [False]])
    starts, ends = np.flatnonzero(~above[:-1] & above[1:]), np.flatnonzero(above[:-1] & ~above[1:])
    for a, b in zip(starts, ends, strict=True):
        if (b - a) / plate.rate < SHORTEST_S or load[a:b].max() < LEAST_PEAK_N:
            continue
        point = plate.cop_ground[(a + b) // 2]
        frame = np.abs(times - plate.times[(a + b) // 2]).argmin()
        if not np.isfinite(point).all():
            continue
        foot = int(np.argmin([np.hypot(*(f[frame] - point)[[0, 2]]) for f in feet_ground]))
        on = off = None
        if a > 0:
            on = plate.times[a] - (load[a] - LEVEL_N) / (load[a] - load[a - 1]) / plate.rate
        if b < len(load):
            off = plate.times[b - 1] + (load[b - 1] - LEVEL_N) / (load[b - 1] - load[b]) / plate.rate
        yield Measured(foot, on, off)


def measured_stances(plates, feet_ground, times):
    """By foot; stances that overlap on two plates, or follow within 30 ms, are one."""
    found = [m for plate in plates for m in one_plate(plate, feet_ground, times)]
    joined = []
    for foot in range(len(feet_ground)):
        own = sorted(
            (m for m in found if m.foot == foot), key=lambda m: -np.inf if m.on_s is None else m.on_s
        )
        for m in own:
            last = joined[-1] if joined and joined[-1].foot == foot else None
            if last and (last.off_s is None or m.on_s is None or m.on_s - last.off_s < 0.03):
                off = None if None in (last.off_s, m.off_s) else max(last.off_s, m.off_s)
                joined[-1] = Measured(foot, last.on_s, off)
            else:
                joined.append(m)
    return joined


@pytest.fixture(scope="session")
def stances_on_plates():
    return measured_stances
