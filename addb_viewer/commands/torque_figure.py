"""The right knee's torque in the arms of an ablation, as one SVG file that needs nothing else."""

from html import escape

import numpy as np
from jaxtyping import Float

from solver.common.runs import runs
from solver.dynamics.cross_validation.ablation import FITTED, MARKERS, STARTED, Repetition

# Okabe and Ito's colours: told apart by colour-blind readers too; the oracle below, ours on top
_LINES = (
    (STARTED["piecewise"], "#E69F00", 1.0),
    (MARKERS, "#999999", 1.0),
    (FITTED["piecewise"], "#D55E00", 1.2),
    (FITTED["oracle"], "#0072B2", 2.4),
    (FITTED["ours"], "#000000", 1.2),
)
_PER_SECOND, _NARROWEST, _WIDEST = 160, 700, 3000  # [px] of the curves
_HEIGHT, _LEFT, _TOP, _BOTTOM = 320, 62, 56, 44  # [px]
_MARGIN = 0.35  # of the oracle's range; curves beyond it are cut off


def torque_figure(times: Float[np.ndarray, " frames"], repetition: Repetition, trial: str) -> str:
    """Draw the torque over time, the hidden frames shaded.

    Args:
        times: of the frames [s].
        repetition: whose arms.
        trial: for the title.
    """
    width = float(np.clip(_PER_SECOND * (times[-1] - times[0]), _NARROWEST, _WIDEST))
    oracle = repetition.knee_torque[FITTED["oracle"]]
    spare = _MARGIN * max(float(np.ptp(oracle)), 1.0)
    low, high = float(oracle.min()) - spare, float(oracle.max()) + spare

    def x(t: float) -> float:
        return _LEFT + width * (t - times[0]) / (times[-1] - times[0])

    def y(torque: float) -> float:
        return _TOP + _HEIGHT * (high - torque) / (high - low)

    parts = [
        f'<text x="{_LEFT}" y="18" font-size="14">Right knee: joint torque, {escape(trial)}; '
        "shaded: force hidden</text>",
        f'<clipPath id="plot"><rect x="{_LEFT}" y="{_TOP}" width="{width:.0f}" height="{_HEIGHT}"/>'
        "</clipPath>",
    ]
    step = 1 / (times[1] - times[0])
    for start, end in runs(repetition.hidden):
        left, right = x(times[start]), x(times[end - 1] + 1 / step)
        parts.append(
            f'<rect x="{left:.1f}" y="{_TOP}" width="{right - left:.1f}" height="{_HEIGHT}" '
            'fill="#eeeeee" clip-path="url(#plot)"/>'
        )
    for value in _ticks(low, high):
        parts.append(
            f'<line x1="{_LEFT}" x2="{_LEFT + width:.0f}" y1="{y(value):.1f}" y2="{y(value):.1f}" '
            'stroke="#cccccc"/>'
            f'<text x="{_LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:g}</text>'
        )
    for value in _ticks(times[0], times[-1]):
        parts.append(
            f'<text x="{x(value):.1f}" y="{_TOP + _HEIGHT + 16}" text-anchor="middle">{value:g}</text>'
        )
    legend = float(_LEFT)
    for arm, colour, stroke in _LINES:
        points = " ".join(
            f"{x(t):.1f},{y(v):.1f}" for t, v in zip(times, repetition.knee_torque[arm], strict=True)
        )
        parts.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{stroke}" '
            'clip-path="url(#plot)"/>'
        )
        parts.append(f'<text x="{legend:.0f}" y="40" fill="{colour}">{escape(arm)}</text>')
        legend += 7.0 * len(arm) + 18
    middle = _TOP + _HEIGHT / 2
    parts += [
        f'<text x="{_LEFT + width / 2:.0f}" y="{_TOP + _HEIGHT + 34}" text-anchor="middle">time [s]</text>',
        f'<text x="14" y="{middle:.0f}" text-anchor="middle" transform="rotate(-90 14 {middle:.0f})">'
        "torque [N·m]</text>",
    ]
    whole = (_LEFT + width + 20, _TOP + _HEIGHT + _BOTTOM)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {whole[0]:.0f} {whole[1]}" '
        f'width="{whole[0]:.0f}" height="{whole[1]}" font-family="sans-serif" font-size="12">\n'
        '<rect width="100%" height="100%" fill="white"/>\n' + "\n".join(parts) + "\n</svg>\n"
    )


def _ticks(low: float, high: float, about: int = 8) -> list[float]:
    """Round numbers from low to high."""
    rough = (high - low) / about
    power = 10.0 ** np.floor(np.log10(rough))
    step = power * next(m for m in (1, 2, 5, 10) if m * power >= rough)
    return [float(step * k) for k in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)]
