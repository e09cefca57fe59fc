"""The figures, drawn with Matplotlib from the rows of `numbers`."""

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import PlaceHolderLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from addb_viewer.dataset.columns import COORDINATE_NAMES, TRANSLATIONS
from addb_viewer.dataset.stats.numbers import (
    ACTIVITY_CLASSES,
    ANGULAR_BWH,
    HICKS_BWH,
    LINEAR_BW,
    UNLABELLED,
    Rows,
)
from addb_viewer.text.amounts import lasting

mpl.rcParams.update(
    {
        "svg.hashsalt": "addb-viewer",  # the same figure, the same bytes
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.axisbelow": True,
        "figure.constrained_layout.use": True,
    }
)
BAR, LIMIT, OTHER_LIMIT = "#0072B2", "#D55E00", "#CC79A7"  # Okabe & Ito 2008
COLORS = dict(
    zip(
        (*ACTIVITY_CLASSES, UNLABELLED),
        (
            "#0072B2",
            "#D55E00",
            "#009E73",
            "#CC79A7",
            "#E69F00",
            "#56B4E9",
            "#882255",
            "#000000",
            "#777777",
            "#BBBBBB",
        ),
        strict=False,
    )
)
MARKS_H = {
    f"{number} {unit}": number * hours
    for unit, hours in (("s", 1 / 3600), ("min", 1 / 60), ("h", 1.0))
    for number in (1, 3, 10, 30, 100)
    if unit == "h" or number < 60
}
MOST_MARKS = 7
FEWEST_LINES = 4  # that a chart of bars has room for, so that one bar is no wall
BINS = 30
POINTS = (1.5, 14.0)  # [pt²] of a scatter plot: where they are many, and few
INK = 3_000.0  # [pt²] of all points of a panel, between these
LEAST_RANGE = {"deg": 1.0, "m": 0.01, "N·m": 1.0, "N": 1.0}  # of an axis: what is smaller is no movement
LEAST_PEOPLE = {"age_years": 20.0, "bmi": 8.0}  # likewise
QUALITY = {
    "marker_cm": "marker error, RMS [cm]",
    "linear_bw": "residual force, RMS [body weights]",
    "angular_bwh": "residual moment, RMS [body weights · h]",
}
LIMITS = {
    "linear_bw": {f"{LINEAR_BW:g} (paper, Hicks)": (LINEAR_BW, LIMIT)},
    "angular_bwh": {
        f"{ANGULAR_BWH:g} (paper)": (ANGULAR_BWH, LIMIT),
        f"{HICKS_BWH:g} (Hicks)": (HICKS_BWH, OTHER_LIMIT),
    },
}
SEXES = ("female", "male")  # whose boxes are drawn
DOTS_UP_TO = 30  # persons of a box, who are drawn too

Panel = tuple[str, str, Float[np.ndarray, " points"]]  # name, unit, values


def activity_figure(rows: Rows) -> Figure | None:
    """Hours of each class, on a log scale; None where there are none."""
    shown = [r for r in rows if r["hours"] > 0]
    if not shown:
        return None
    figure = Figure(figsize=(6.4, 3.2))
    axes = figure.subplots()
    axes.barh([r["activity"] for r in shown], [r["hours"] for r in shown], color=BAR)
    axes.set_xscale("log")
    low, high = min(r["hours"] for r in shown) / 2, max(r["hours"] for r in shown) * 4
    marks = [words for words, hours in MARKS_H.items() if low <= hours <= high]
    marks = marks[:: 1 + len(marks) // MOST_MARKS]
    axes.set_xlim(low, high)
    axes.set_ylim(max(len(shown), FEWEST_LINES) - 0.4, -0.6)
    for r in shown:
        axes.annotate(
            lasting(r["hours"]),
            (r["hours"], r["activity"]),
            (4, 0),
            textcoords="offset points",
            va="center",
        )
    axes.set_xticks([MARKS_H[words] for words in marks], marks)
    axes.minorticks_off()
    axes.set_xlabel("duration of the frames shown (log scale)")
    axes.grid(axis="x", alpha=0.3)
    return figure


def speed_length_figure(rows: Rows) -> Figure | None:
    """Average speed, where any is known, and number of frames, of every segment; None where there is none."""
    if not rows:
        return None
    speeds = _known(rows, "speed_m_s")
    figure = Figure(figsize=(8, 3.2))
    *others, right = figure.subplots(1, 2 if speeds else 1, squeeze=False)[0]
    for left in others:
        _histogram(left, speeds, "average speed [m/s]")
    lengths = {
        "all frames": [r["frames"] for r in rows],
        "with force": [r["frames_with_force"] for r in rows],
        "with dynamics": [r["frames_with_dynamics"] for r in rows],
    }
    longest = max(lengths["all frames"])
    for (name, values), color, width in zip(
        lengths.items(), (BAR, "#009E73", LIMIT), (3.2, 1.8, 0.8), strict=True
    ):  # the later the thinner, so that equal ones are all seen
        bins = np.linspace(0, longest, BINS + 1).tolist()
        right.hist(values, bins=bins, histtype="step", label=name, color=color, lw=width)
    right.set_xlabel("frames")
    _counts(right)
    _legend_above(right)
    return figure


def contact_figure(rows: Rows) -> Figure | None:
    """How much of each segment's frames is double support, single support and flight; None: unknown."""
    groups = {
        "double_percent": "double support",
        "single_percent": "single support",
        "flight_percent": "flight",
    }
    values = [_known(rows, name) for name in groups]
    if not any(values):
        return None
    figure = Figure(figsize=(6.4, 3.2))
    axes = figure.subplots()
    axes.hist(
        values,
        bins=np.linspace(0, 100, 11).tolist(),
        label=list(groups.values()),
        color=[BAR, "#E69F00", "#009E73"],
    )
    axes.set_xlabel("share of a segment's frames [%]")
    _counts(axes)
    _legend_above(axes)
    return figure


def demographics_figure(rows: Rows) -> Figure | None:
    """Age and body mass index by sex, of all persons and of those in the figures; None: unknown."""
    named = {"age_years": "age [years]", "bmi": "body mass index [kg/m²]"}
    known = [r for r in rows if r["sex"] in SEXES]
    shown = {name: words for name, words in named.items() if any(r[name] is not None for r in known)}
    if not shown:
        return None
    figure = Figure(figsize=(4 * len(shown), 3.4))
    for axes, (name, words) in zip(
        figure.subplots(1, len(shown), squeeze=False)[0], shown.items(), strict=True
    ):
        boxes, names = [], []
        for sex in SEXES:
            for group, members in (("all", rows), ("shown", [r for r in rows if r["in_figures"]])):
                of_sex = [float(r[name]) for r in members if r["sex"] == sex and r[name] is not None]
                if of_sex:
                    boxes.append(of_sex)
                    names.append(f"{sex}\n{group} ({len(of_sex)})")
        axes.boxplot(boxes, tick_labels=names, widths=0.5, medianprops={"color": LIMIT})
        for place, box in enumerate(boxes, start=1):
            if len(box) <= DOTS_UP_TO:
                axes.plot(np.full(len(box), place), box, "o", ms=3.5, alpha=0.5, color=BAR)
        _not_below(axes, LEAST_PEOPLE[name])
        axes.set_ylabel(words)
    return figure


def quality_figure(rows: Rows) -> Figure | None:
    """Marker errors and residuals, RMS of each segment, with the published limits; None: unknown."""
    known = {name: values for name in QUALITY if (values := _known(rows, name))}
    if not known:
        return None
    figure = Figure(figsize=(1 + 3 * len(known), 3.2))
    for axes, (name, values) in zip(
        figure.subplots(1, len(known), squeeze=False)[0], known.items(), strict=True
    ):
        limits = LIMITS.get(name, {})
        reach = max((value for value, color in limits.values() if color == LIMIT), default=0.0)
        _histogram(axes, values, QUALITY[name], reach)
        if limits:
            _limits(axes, limits)
    return figure


def scatter_figures(rows: Rows) -> Mapping[str, Figure | None]:
    """Angles, moments and joint centres against the share of the right foot and the load; by name.

    Args:
        rows: a frame each.
    """
    slides = [name in TRANSLATIONS for name in COORDINATE_NAMES]
    angles, moments, joints = [], [], []
    for name, slide in zip(COORDINATE_NAMES, slides, strict=True):
        angle = _values(rows, f"q_{name}")
        angles.append((name, "m" if slide else "deg", angle if slide else np.degrees(angle)))
        moments.append((name, "N" if slide else "N·m", _values(rows, f"tau_{name}")))
    for column in (name for name in (rows[0] if rows else ()) if name.startswith("distance_")):
        distance = _values(rows, column)
        if (distance > 0).any():  # not the root's own
            joints.append((column.removeprefix("distance_").removesuffix("_m"), "m", distance))
    share, load = "share of the right foot", "vertical force / mass [N/kg]"
    return {
        "angles_share": _panels(rows, angles, share, "right_share"),
        "moments_share": _panels(rows, moments, share, "right_share"),
        "angles_load": _panels(rows, angles, load, "load_N_kg"),
        "moments_load": _panels(rows, moments, load, "load_N_kg"),
        "joints_load": _panels(rows, joints, load, "load_N_kg"),
    }


def _values(rows: Rows, name: str) -> Float[np.ndarray, " points"]:
    return np.array([row[name] for row in rows], dtype=float)


def _panels(rows: Rows, panels: Sequence[Panel], label: str, across: str) -> Figure | None:
    at = _values(rows, across)
    shown = [panel for panel in panels if np.isfinite(panel[2] + at).any()]
    if not shown:
        return None
    columns = 6
    lines = -(-len(shown) // columns)
    height = 1.9 * lines + 0.8
    by_hand = PlaceHolderLayoutEngine(adjust_compatible=True, colorbar_gridspec=True)
    figure = Figure(figsize=(13, height), layout=by_hand)  # forty panels would take most of the time
    figure.subplots_adjust(0.04, 0.5 / height, 0.99, 1 - 0.55 / height, wspace=0.28, hspace=0.42)
    axes = np.atleast_1d(figure.subplots(lines, columns, squeeze=False)).ravel()
    labels = [row["activity"] for row in rows]
    order = np.random.default_rng(0).permutation(len(labels))  # no class lies on top of the others
    colors = [COLORS[labels[k]] for k in order]
    few, many = POINTS[::-1]
    size = float(np.clip(INK / max(len(labels), 1), many, few))
    for place, (name, unit, values) in zip(axes, shown, strict=False):
        place.scatter(at[order], values[order], s=size, c=colors, linewidths=0, rasterized=True)
        _not_below(place, LEAST_RANGE[unit])
        place.set_title(f"{name} [{unit}]", fontsize=8)
        place.tick_params(labelsize=7)
    for place in axes[len(shown) :]:
        place.set_visible(False)
    figure.supxlabel(label)
    handles = [
        Line2D([], [], marker="o", ls="", color=COLORS[name], label=name)
        for name in COLORS
        if name in set(labels)
    ]
    if handles:
        figure.legend(handles=handles, loc="upper center", ncols=len(handles), frameon=False)
    return figure


def _histogram(axes: Axes, values: list[float], label: str, reach: float = 0.0) -> None:
    """From zero to the largest value, or to `reach` where that is more."""
    axes.hist(values, bins=BINS, range=(0, max([*values, reach]) * 1.02 or 1), color=BAR)
    axes.set_xlabel(label)
    _counts(axes)


def _counts(axes: Axes) -> None:
    axes.set_ylabel("number of segments")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))


def _not_below(axes: Axes, least: float) -> None:
    """Widen the vertical axis about its middle to that range."""
    low, high = axes.get_ylim()
    if high - low < least:
        middle = (low + high) / 2
        axes.set_ylim(middle - least / 2, middle + least / 2)


def _legend_above(axes: Axes) -> None:
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)


def _limits(axes: Axes, limits: Mapping[str, tuple[float, str]]) -> None:
    for words, (value, color) in limits.items():
        axes.axvline(value, color=color, ls="--", lw=1.2, label=words)
    _legend_above(axes)


def _known(rows: Rows, name: str) -> list[float]:
    return [float(r[name]) for r in rows if r[name] is not None and np.isfinite(r[name])]
