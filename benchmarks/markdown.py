"""Rates with their intervals, tables of text, and sections of pages, each written by one program."""

from collections.abc import Sequence
from pathlib import Path

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


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines)


def replaced(page: str, name: str, section: str) -> str:
    """The page with this section in place of the one before; at its end if there was none.

    Args:
        page: as Markdown.
        name: of the program in `benchmarks` whose section it is, by which its markers are known.
        section: as Markdown, without markers.

    Raises:
        ValueError: the section before has a beginning and no end.
    """
    begin, end = f"<!-- made by python -m benchmarks.{name} -->", f"<!-- end of benchmarks.{name} -->"
    whole = f"{begin}\n\n{section.strip()}\n\n{end}"
    before, found, rest = page.partition(begin)
    if not found:
        return f"{page.rstrip()}\n\n{whole}\n" if page.strip() else f"{whole}\n"
    _, ended, after = rest.partition(end)
    if not ended:
        raise ValueError(f"The page has '{begin}' without '{end}' after it. Write that line back.")
    return f"{before}{whole}{after}"


def write_section(page: Path, name: str, section: str) -> None:
    """Put a section into a page, which is made if it isn't there.

    Args:
        page: a file of Markdown.
        name: as of `replaced`.
        section: as of `replaced`.
    """
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    page.write_text(replaced(text, name, section), encoding="utf-8")
