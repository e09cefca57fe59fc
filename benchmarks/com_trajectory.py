"""Seconds of the centre-of-mass trajectory against the number of frames and the share of them unobserved.

python -m benchmarks.com_trajectory
"""

import time
from dataclasses import replace

import numpy as np

from solver.dynamics.com_data import ComData
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import fit_com_trajectory

FRAMES = (1_000, 10_000, 100_000)
UNSEEN_SHARES = (0.0, 0.3, 1.0)
REPEATS = 5
RATE = 100.0  # [Hz]
GRAVITY = np.array([0.0, -9.80665, 0.0])
FORMS = {
    "as in the paper": replace(ComSettings(), force_error_m_s2=0.0),
    "default": ComSettings(),
}


def scaling_table() -> str:
    """A row for every form and share of unobserved frames; best of several CPU seconds in each column."""
    lines = [
        "| form | unobserved | " + " | ".join(f"{n} frames: ms" for n in FRAMES) + " | last over first |",
        "|---|---|" + "---:|" * (len(FRAMES) + 1),
    ]
    for form, settings in FORMS.items():
        for share in UNSEEN_SHARES:
            seconds = [_seconds(_trial(frames, share), settings) for frames in FRAMES]
            cells = " | ".join(f"{1000 * s:.1f}" for s in seconds)
            lines.append(f"| {form} | {share:.0%} | {cells} | {seconds[-1] / seconds[0]:.0f} |")
    return "\n".join(lines)


def _trial(frames: int, unseen_share: float) -> ComData:
    """A point mass that bobs; half-second stretches of it unobserved."""
    rng = np.random.default_rng(frames)
    bob = 3.0 * np.sin(2 * np.pi * 2.0 * np.arange(frames) / RATE)[:, None] * np.array([0.3, 1.0, 0.1])
    stretches = rng.random(frames // 50 + 1) < unseen_share
    return ComData(
        com_ground=-bob / (2 * np.pi * 2.0) ** 2 + 0.005 * rng.normal(size=(frames, 3)),
        force_ground=75.0 * (bob - GRAVITY),
        observed=~np.repeat(stretches, 50)[:frames],
        rate=RATE,
        gravity=GRAVITY,
    )


def _seconds(data: ComData, settings: ComSettings) -> float:
    best = np.inf
    for _ in range(REPEATS):
        start = time.process_time()
        fit_com_trajectory(data, settings)
        best = min(best, time.process_time() - start)
    return best


if __name__ == "__main__":
    print(scaling_table())
