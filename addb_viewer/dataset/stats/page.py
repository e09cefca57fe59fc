"""Every table and figure as files, and one page that holds them all."""

import base64
import csv
import html
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from addb_viewer.dataset.stats import numbers
from addb_viewer.dataset.stats.numbers import (
    ANGULAR_BWH,
    EVERY,
    HICKS_BWH,
    LINEAR_BW,
    LOADED_N,
    MOST_POINTS,
    Frames,
    Gathered,
    Rows,
    gathered,
)
from solver.capture.atomic import made_folder, whole_file, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class PaperSource:
    """A row of the dataset paper's table 1 (Werling et al. 2024), beside which ours stands."""

    source: str
    subjects: int
    total_hours: float
    grf_hours: float


PAPER_SOURCES = (
    PaperSource("Lencioni et al. 2019", 50, 0.52, 0.37),
    PaperSource("Carter et al. 2023", 50, 21.60, 19.80),
    PaperSource("Santos et al. 2017", 49, 4.90, 4.90),
    PaperSource("Camargo et al. 2021", 22, 19.87, 10.10),
    PaperSource("Tan et al. 2023", 17, 4.40, 4.40),
    PaperSource("Moore et al. 2015", 12, 6.22, 6.03),
    PaperSource("Falisse et al. 2016", 11, 0.49, 0.10),
    PaperSource("Hamner et al. 2013", 10, 0.02, 0.02),
    PaperSource("Van der Zee et al. 2022", 10, 5.46, 5.31),
    PaperSource("Uhlrich et al. 2023", 10, 0.24, 0.05),
    PaperSource("Tan et al. 2022", 9, 3.73, 3.73),
    PaperSource("Wang et al. 2023", 9, 1.84, 1.84),
    PaperSource("Han et al. 2023", 7, 1.70, 0.52),
    PaperSource("Fregly et al. 2012", 6, 0.14, 0.04),
    PaperSource("Li et al. 2021", 1, 0.34, 0.34),
)
PAPER_SUM = PaperSource("Sum", 273, 71.47, 57.55)  # as the paper prints it

CLINICAL_HOURS, CLINICAL_PERCENT_IN_TEXT = 12.1, 21.2
SUPPORT_PERCENT = {"single support": 53.4, "double support": 21.2, "flight": 25.4}
PAPER_MARKER, PAPER_LINEAR, PAPER_ANGULAR = (
    (2.17, 2.44),
    (0.046, 0.027),
    (0.11, 0.02),
)  # [cm], [BW], [BW·h]: mean, SD

FRAMES_WORDS = {
    Frames.PAPER: "frames of reviewed trials whose force counts, and in which detection finds no fault "
    "either (the paper's choice)",
    Frames.REVIEWED: "frames of reviewed trials whose force counts",
    Frames.ALL: "all frames whose force counts, reviewed or not",
}
STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem;
  color: #1a1a1a }
h1 { font-size: 1.7rem; margin-bottom: .2rem } h2 { margin-top: 2.4rem; font-size: 1.25rem }
table { border-collapse: collapse; margin: .8rem 0; font-variant-numeric: tabular-nums }
th, td { padding: .2rem .9rem .2rem 0; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap }
th:first-child, td:first-child { text-align: left } tr.sum td { font-weight: 600 }
img { max-width: 100%; height: auto; display: block; margin: .8rem 0 } figure { margin: 0 }
.note { color: #555; max-width: 46rem }
.warning { background: #fff3cd; padding: .5rem .8rem; border-radius: 4px }
nav a { margin-right: .9rem } .wide { overflow-x: auto }
"""


def page(name: str, frames: Frames, tables: Mapping[str, Rows], pictures: Mapping[str, bytes]) -> str:
    """The whole page.

    Args:
        name: of the release.
        frames: which of them figures are about.
        tables: by name, as the CSV files hold them.
        pictures: PNG by name; those of which nothing is known are not there.
    """
    sections = (
        ("sources", "Sources", _sources(tables["sources"])),
        (
            "activity",
            "Activities",
            _picture(pictures, "activity", "Duration of each class; transitions are other."),
        ),
        ("speed", "Speed and length", _picture(pictures, "speed_length", _SEGMENTS)),
        ("contact", "Support", _contact(tables["contact"]) + _picture(pictures, "contact", _CONTACT)),
        ("people", "People", _people(tables["demographics"]) + _picture(pictures, "demographics", _BOXES)),
        ("quality", "Quality", _quality(tables["quality"]) + _picture(pictures, "quality", _QUALITY)),
        ("clinical", "Within the limits for clinical use", _clinical(tables["clinical"])),
        ("scatter", "Joints against forces", _scatter(pictures, len(tables["scatter"]))),
    )
    links = "".join(f"<a href='#{anchor}'>{title}</a>" for anchor, title, _ in sections)
    body = "".join(f"<h2 id='{anchor}'>{title}</h2>{content}" for anchor, title, content in sections)
    shown = sum(row["frames_with_force"] for row in tables["segments"])
    empty = "" if shown else _EMPTY
    return (
        f"<!doctype html><html lang='en'><head><meta charset='utf-8'>"
        "<meta name='generator' content='addb-viewer'>"
        f"<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<title>{html.escape(name)}: what it holds</title><style>{STYLE}</style></head><body>"
        f"<h1>{html.escape(name)}</h1><p class='note'>Figures are about {FRAMES_WORDS[frames]}: "
        f"{shown:,} frames. Every table and figure lies beside this page as CSV, SVG and PNG.</p>"
        f"{empty}<nav>{links}</nav>{body}</body></html>\n"
    )


_EMPTY = (
    "<p class='warning'>No frame of this release is such a frame, so figures are empty. "
    "<code>--frames reviewed</code> or <code>--frames all</code> shows others.</p>"
)
_SEGMENTS = (
    "Of segments, which are at most 2000 frames long. Speed of the centre of mass; on a treadmill, how fast "
    "the belt carries the standing foot."
)
_CONTACT = "How much of each segment is double support, single support and flight, in steps of ten per cent."
_BOXES = (
    "Boxes from quartile to quartile, median in orange, whiskers to 1.5 times the box, circles beyond; each "
    "person as a dot where they are few."
)
_QUALITY = "Each segment counts once. Dashed: published limits."


def _sources(rows: Rows) -> str:
    ours = _table(
        ("source", "persons", "total hours", "GRF hours"),
        [(r["source"], r["subjects"], _h(r["total_hours"]), _h(r["grf_hours"])) for r in rows],
        sum_last=True,
    )
    paper = _table(
        ("source (the paper's release 1.0)", "persons", "total hours", "GRF hours"),
        [(s.source, s.subjects, _h(s.total_hours), _h(s.grf_hours)) for s in (*PAPER_SOURCES, PAPER_SUM)],
        sum_last=True,
    )
    note = (
        "<p class='note'>GRF hours: frames that the figures are about. Persons are counted once, also where "
        "they have several subjects.</p>"
    )
    return f"{ours}{note}<details><summary>The dataset paper's table</summary>{paper}</details>"


def _contact(rows: Rows) -> str:
    return _table(
        ("support", "% of frames", "mean % of segments", "the paper's release: % of frames"),
        [
            (
                r["support"],
                _n(r["percent_of_frames"], 1),
                _n(r["percent_of_segments_mean"], 1),
                _n(SUPPORT_PERCENT[r["support"]], 1),
            )
            for r in rows
        ],
    )


def _people(rows: Rows) -> str:
    def told(r: Mapping[str, Any], name: str, digits: int) -> str:
        mean, sd, low, high = (r[f"{name}_{what}"] for what in ("mean", "sd", "min", "max"))
        reach = "" if math.isnan(sd) else f" ({_n(low, digits)} to {_n(high, digits)})"
        return _spread(mean, sd, digits) + reach

    return _table(
        ("persons", "sex", "n", "%", "age [years]", "age unknown", "BMI [kg/m²]", "BMI unknown"),
        [
            (
                r["persons"],
                r["sex"],
                r["n"],
                _n(r["percent"], 1),
                told(r, "age_years", 1),
                r["age_years_unknown"],
                told(r, "bmi", 1),
                r["bmi_unknown"],
            )
            for r in rows
            if r["n"]
        ],
    )


def _quality(rows: Rows) -> str:
    words = {
        "marker_cm": ("marker error [cm]", 2, PAPER_MARKER),
        "linear_bw": ("residual force [body weights]", 4, PAPER_LINEAR),
        "angular_bwh": ("residual moment [body weights · height]", 4, PAPER_ANGULAR),
    }
    return _table(
        ("RMS of a segment", "segments", "mean ± SD", "weighted by frames", "limit", "the paper's release"),
        [_quality_row(r, *words[r["figure"]]) for r in rows],
    )


def _quality_row(
    r: Mapping[str, Any], words: str, digits: int, paper: tuple[float, float]
) -> tuple[object, ...]:
    def both(kind: str) -> str:
        return _spread(r[f"mean{kind}"], r[f"sd{kind}"] if r["n"] > 1 else math.nan, digits)

    limit = "–" if math.isnan(r["limit"]) else f"{r['limit']:g}"
    return words, r["n"], both(""), both("_by_frames"), limit, f"{paper[0]:g} ± {paper[1]:g}"


def _clinical(rows: Rows) -> str:
    table = _table(
        ("limits", "residual force", "residual moment", "segments", "hours", "% of GRF hours"),
        [
            (
                "the paper's" if r["limits"] == "paper" else "Hicks et al. 2015",
                f"≤ {r['linear_bw']:g} BW",
                f"≤ {r['angular_bwh']:g} BW·h",
                r["segments"],
                _h(r["hours"]),
                _n(r["percent_of_grf_hours"], 1),
            )
            for r in rows
        ],
    )
    return (
        f"{table}<p class='note'>The denominator is the sum of the GRF hours above. The paper has "
        f"{CLINICAL_HOURS} hours within {LINEAR_BW} BW and {ANGULAR_BWH} BW·h. Its text calls that "
        f"{CLINICAL_PERCENT_IN_TEXT} %; of the {PAPER_SUM.grf_hours} GRF hours of its own table it is "
        f"{clinical_percent():.1f} %. Hicks et al. ask for {HICKS_BWH} of the moment.</p>"
    )


def _scatter(pictures: Mapping[str, bytes], points: int) -> str:
    note = (
        f"<p class='note'>{points:,} frames: every {EVERY}th, at most {MOST_POINTS:,}, chosen by lot. The "
        f"share of the right foot is of both vertical forces, where these are above {LOADED_N:g} N "
        f"together.</p>"
    )
    words = {
        "angles_share": "Coordinates against the share of the right foot.",
        "moments_share": "Joint moments against the share of the right foot.",
        "angles_load": "Coordinates against the vertical force.",
        "moments_load": "Joint moments against the vertical force.",
        "joints_load": "Distance of joint centres from the pelvis' origin against the vertical force.",
    }
    return note + "".join(_picture(pictures, name, caption) for name, caption in words.items())


def _picture(pictures: Mapping[str, bytes], name: str, caption: str) -> str:
    if name not in pictures:
        return "<p class='note'>Nothing is known of this.</p>"
    data = base64.b64encode(pictures[name]).decode()
    return (
        f"<figure><img alt='{html.escape(caption)}' src='data:image/png;base64,{data}'>"
        f"<figcaption class='note'>{html.escape(caption)}</figcaption></figure>"
    )


def _table(heads: Sequence[str], rows: Sequence[Sequence[object]], sum_last: bool = False) -> str:
    head = "".join(f"<th>{html.escape(h)}</th>" for h in heads)
    lines = []
    for k, row in enumerate(rows):
        cells = "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row)
        lines.append(f"<tr{' class=sum' if sum_last and k == len(rows) - 1 else ''}>{cells}</tr>")
    return f"<div class='wide'><table><tr>{head}</tr>{''.join(lines)}</table></div>"


def _h(hours: float) -> str:
    """Hours with digits that a small release shows too."""
    return f"{hours:.2f}" if hours >= 1 or not hours else f"{hours:.4f}"


def _n(value: float, digits: int) -> str:
    return "–" if math.isnan(value) else f"{value:.{digits}f}"


def _spread(mean: float, sd: float, digits: int) -> str:
    """Mean ± SD; of one value, itself."""
    return _n(mean, digits) if math.isnan(sd) else f"{_n(mean, digits)} ± {_n(sd, digits)}"


def clinical_percent() -> float:
    """What the paper's clinical hours are of its hours with forces [%]; its text says otherwise."""
    return 100 * CLINICAL_HOURS / PAPER_SUM.grf_hours


DOTS_PER_INCH = 150
KINDS: dict[str, dict[str, Any]] = {  # of files of a figure; the same numbers give the same bytes
    "svg": {"metadata": {"Date": None}},
    "png": {"metadata": {"Software": None}, "dpi": DOTS_PER_INCH},
}


def stats_of(found: Gathered) -> dict[str, Rows]:
    """The numbers of every table and figure, by the name of their file.

    Args:
        found: in a release.
    """
    segments, persons = numbers.segments(found), numbers.persons(found)
    sources = numbers.sources(found)
    return {
        "sources": sources,
        "activity": numbers.activity(found),
        "segments": segments,
        "contact": numbers.contact(segments),
        "persons": persons,
        "demographics": numbers.demographics(persons),
        "quality": numbers.quality(segments),
        "clinical": numbers.clinical(segments, sources[-1]["grf_hours"]),
        "scatter": found.points,
    }


def write_stats(release: Path, out: Path, frames: Frames | None) -> tuple[dict[str, Rows], Frames, Path]:
    """Describe a release.

    Args:
        release: its folder.
        out: folder for the files; made if it does not exist.
        frames: which frames figures are about; None: the paper's choice, or all where that is none.

    Returns:
        The numbers, which frames they are about, and the page.

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
    tables = stats_of(found)
    figures = {
        "activity": drawing.activity_figure(tables["activity"]),
        "speed_length": drawing.speed_length_figure(tables["segments"]),
        "contact": drawing.contact_figure(tables["segments"]),
        "demographics": drawing.demographics_figure(tables["persons"]),
        "quality": drawing.quality_figure(tables["segments"]),
        **drawing.scatter_figures(found.points),
    }
    made_folder(out)
    for name, rows in tables.items():
        write_whole(out / f"{name}.csv", as_csv(rows))
    pictures = {name: _written(figure, out, name) for name, figure in figures.items() if figure is not None}
    for name in set(figures) - set(pictures):
        for kind in KINDS:  # of another release
            (out / f"{name}.{kind}").unlink(missing_ok=True)
    path = out / "index.html"
    write_whole(path, page(release.resolve().name, chosen, tables, pictures))
    return tables, chosen, path


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
    for kind, options in KINDS.items():
        with whole_file(out / f"{name}.{kind}") as file:
            figure.savefig(file, format=kind, **options)
    return (out / f"{name}.png").read_bytes()
