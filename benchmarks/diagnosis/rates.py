"""Rates with their intervals, and tables of text."""

from collections.abc import Sequence

import numpy as np

Z95 = 1.959964  # two-sided 95 %


def wilson(hits: float, count: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a rate. Wilson EB. J Am Stat Assoc 1927; 22: 209-212."""
    if not count:
        return 0.0, 1.0
    p, z = hits / count, Z95
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * np.sqrt(p * (1 - p) / count + z * z / (4 * count * count))
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def rate(hits: float, count: int) -> str:
    """`93 % [86, 97] (28.0/30)`."""
    if not count:
        return "-"
    low, high = wilson(hits, count)
    return f"{100 * hits / count:.0f} % [{100 * low:.0f}, {100 * high:.0f}] ({hits:g}/{count})"


def smallest_found(sizes: Sequence[float], hits: Sequence[float], least: float = 0.9) -> float | None:
    """The smallest size from which on every tested size is found with at least that probability."""
    smallest = None
    for size in sorted(set(sizes), reverse=True):
        here = [h for s, h in zip(sizes, hits, strict=True) if s == size]
        if np.mean(here) < least:
            break
        smallest = size
    return smallest


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines)
