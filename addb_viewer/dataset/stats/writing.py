"""Every table and figure as files, and one page that holds them all."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from addb_viewer.dataset.stats import numbers
from addb_viewer.dataset.stats.gathering import Frames, Gathered, gathered
from addb_viewer.dataset.stats.page import page
from solver.capture.atomic import made_folder, whole_file, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 150


@dataclass(frozen=True)
class Stats:
    """All numbers, by the name of their file."""

    frames: Frames
    tables: Mapping[str, numbers.Rows]


def stats_of(found: Gathered, frames: Frames) -> Stats:
    """The numbers of every table and figure.

    Args:
        found: in a release.
        frames: which of its frames.
    """
    segments, persons = numbers.segments(found), numbers.persons(found)
    sources = numbers.sources(found)
    return Stats(
        frames,
        {
            "sources": sources,
            "activity": numbers.activity(found),
            "segments": segments,
            "contact": numbers.contact(segments),
            "persons": persons,
            "demographics": numbers.demographics(persons),
            "quality": numbers.quality(segments),
            "clinical": numbers.clinical(segments, sources[-1]["grf_hours"]),
            "scatter": numbers.scatter(found),
        },
    )


def write_stats(release: Path, out: Path, frames: Frames | None) -> tuple[Stats, Path]:
    """Describe a release.

    Args:
        release: its folder.
        out: folder for the files; made if it does not exist.
        frames: which frames figures are about; None: the paper's choice, or all where that is none.

    Returns:
        The numbers, and the page.

    Raises:
        ReleaseError: a table of the release is missing or cannot be read.
        CaptureError: the folder cannot be written to.
    """
    from addb_viewer.dataset.stats import drawing  # noqa: PLC0415 (Matplotlib is slow to load, and an extra)

    chosen = frames or Frames.PAPER
    found = gathered(release, chosen)
    if frames is None and not found.hours:
        chosen = Frames.ALL
        found = gathered(release, chosen)
    stats = stats_of(found, chosen)
    tables = stats.tables
    figures = {
        "activity": drawing.activity_figure(tables["activity"]),
        "speed_length": drawing.speed_length_figure(tables["segments"]),
        "contact": drawing.contact_figure(tables["segments"]),
        "demographics": drawing.demographics_figure(tables["persons"]),
        "quality": drawing.quality_figure(tables["segments"]),
        **drawing.scatter_figures(found.sample),
    }
    made_folder(out)
    for name, rows in tables.items():
        write_whole(out / f"{name}.csv", as_csv(rows))
    pictures = {name: _written(figure, out, name) for name, figure in figures.items()}
    path = out / "index.html"
    write_whole(path, page(release.resolve().name, stats.frames, tables, pictures))
    return stats, path


def as_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows as CSV with a head; what is not known is empty.

    Args:
        rows: all with the same columns.
    """
    text = io.StringIO()
    if rows:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return text.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else f"{value:.6g}"
    return "" if value is None else value


def _written(figure: "Figure", out: Path, name: str) -> bytes:
    """Both files of a figure; the PNG's bytes."""
    with whole_file(out / f"{name}.svg") as file:
        figure.savefig(file, format="svg", metadata={"Date": None})
    with whole_file(out / f"{name}.png") as file:
        figure.savefig(file, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})
    return (out / f"{name}.png").read_bytes()
