"""Main joint angles, torques and powers over the gait cycle: each foot's mean and deviation, side by side."""

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
from jaxtyping import Float

from addb_viewer.report.markup import Safe, element, joined, swatch, table
from addb_viewer.text.coordinate_words import JOINTS, torque_bands
from addb_viewer.trial_view.by_cycle import CycledTrial, axis_limits
from addb_viewer.trial_view.chart_html import HEIGHT, WIDTH, curve_path, nice_ticks, number
from addb_viewer.trial_view.joint_quantities import JointQuantity, Kind
from addb_viewer.trial_view.over_time import SIDE_COLORS
from addb_viewer.trial_view.trial_curves import trial_curves
from solver.export.trial_table import angle_columns
from solver.fitting.fit_result import Fit
from solver.fitting.fit_summary import TrialFigures
from solver.gait.stride_curves import StrideCurves
from solver.gait.trial_gait import Gait

MAIN = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")  # rows, in models that have them
KINDS = (Kind.POSITION, Kind.TORQUE, Kind.POWER)  # columns
SHOWN = slice(None, None, 2)  # of the points: every second percent
FINE = (
    "From one contact of a foot (0 %) to its next (100 %): line, mean of the strides; band, one standard "
    "deviation between strides; upright line, mean foot-off. Torques are internal moments, positive in the "
    "direction that the title names; power is positive where the joint delivers work. Torques and powers are "
    "of strides whose frames all count, predicted ones of all."
)
ANGLES = {  # rows: OpenSim's name, CGM's, ISB's
    "pelvis: tilt": ("opensim_pelvis_tilt", "cgm_pelvis_tilt", "isb_pelvis_tilt"),
    "pelvis: obliquity": ("opensim_pelvis_list", "cgm_pelvis_obliquity", "isb_pelvis_obliquity"),
    "pelvis: rotation": ("opensim_pelvis_rotation", "cgm_pelvis_rotation", "isb_pelvis_rotation"),
    "hip: flexion": ("opensim_hip_flexion", "cgm_hip_flexion", "isb_hip_flexion"),
    "hip: adduction": ("opensim_hip_adduction", "cgm_hip_adduction", "isb_hip_adduction"),
    "hip: internal rotation": ("opensim_hip_rotation", "cgm_hip_rotation", "isb_hip_rotation"),
    "knee: flexion": ("opensim_knee_angle", "cgm_knee_flexion", "isb_knee_flexion"),
    "ankle: dorsiflexion": ("opensim_ankle_angle", "cgm_ankle_dorsiflexion", "isb_ankle_dorsiflexion"),
    "ankle: inversion": ("opensim_subtalar_angle", "", "isb_ankle_inversion"),
    "ankle: internal rotation": ("", "cgm_ankle_rotation", "isb_ankle_rotation"),
}
ANGLE_HEAD = (
    "Angle [°]",
    *(f"{of}, {side}" for of in ("OpenSim", "CGM", "ISB") for side in ("right", "left")),
)
OF_ANGLES = (
    "Least to greatest of each trial. OpenSim: the model's coordinates. CGM: as Plug-in Gait gives angles. "
    "ISB: Grood and Suntay; the pelvis as Baker 2001. All are of the fitted segments, whose neutral pose is "
    "the model's: angles of bony axes have offsets."
)
OF_BANDS = "95 %, by the markers' errors; median frame, worse side"
Drawn = Sequence[tuple[str, StrideCurves]]  # by side


def joints_part(fit: Fit, gaits: Mapping[str, Gait], trials: Mapping[str, TrialFigures]) -> Safe | None:
    """Charts of every trial with strides; None where nobody takes a whole stride.

    Args:
        fit: of the subject.
        gaits: by trial.
        trials: the figures of those that the report is about.
    """
    pieces: list[Safe] = []
    for trial in fit.trials:
        name = trial.capture.name
        gait = gaits.get(name)
        if name in trials and gait is not None and gait.cycles:
            bands = torque_bands(trials[name].torque_std_Nm)
            cycled = CycledTrial(trial_curves(trial, fit.skeleton), gait)
            pieces += _trial(cycled, ", ".join(bands[stem] for stem in JOINTS if stem in bands))
    if not pieces:
        return None
    return joined((element("p", FINE, class_="fine"), *pieces))


def angles_part(fit: Fit, trials: Collection[str]) -> Safe | None:
    """Least and greatest angles of every trial, as OpenSim's model and as others have them; None without any.

    Args:
        fit: of the subject.
        trials: names of those that the report is about.
    """
    tables = [
        element(
            "div", element("h3", trial.capture.name), table(ANGLE_HEAD, rows, "numbers"), class_="together"
        )
        for trial in fit.trials
        if trial.capture.name in trials and (rows := _angle_rows(angle_columns(trial, fit.skeleton)))
    ]
    return joined((element("p", OF_ANGLES, class_="fine"), *tables)) if tables else None


def _angle_rows(columns: Mapping[str, np.ndarray]) -> list[list[str]]:
    rows = []
    for words, names in ANGLES.items():
        cells = [
            _span(next((columns[n] for n in (f"{name}_{side}_deg", f"{name}_deg") if n in columns), None))
            for name in names
            for side in ("r", "l")
        ]
        if any(cells):
            rows.append([words, *(cell or "–" for cell in cells)])
    return rows


def _span(values: Float[np.ndarray, " frames"] | None) -> str:
    if values is None or not np.isfinite(values).any():
        return ""
    low, high = (f"{round(value) + 0}".replace("-", "−") for value in (np.nanmin(values), np.nanmax(values)))
    return f"{low} to {high}"


def _trial(trial: CycledTrial, bands: str) -> list[Safe]:
    quantities = trial.quantities()
    rows = []
    for stem in MAIN:
        wanted = [quantities[f"{stem} {kind}"] for kind in KINDS if f"{stem} {kind}" in quantities]
        charts = [_chart(quantity, list(trial.curves(quantity))) for quantity in wanted]
        if charts:
            rows.append(element("div", *charts, class_="joints"))
    if not rows:
        return []
    said = [element("p", f"Torques {bands} ({OF_BANDS}).", class_="fine")] if bands else []
    heading = element("div", element("h3", trial.of.name), _counts(trial), *said, rows[0], class_="together")
    return [heading, *rows[1:]]


def _counts(trial: CycledTrial) -> Safe:
    """Which colour is which side, and of how many strides."""
    told = []
    for side in ("right", "left"):
        count = len(trial.cycles(side))
        words = f"{side}, {count} stride{'' if count == 1 else 's'}"
        told.append(element("span", swatch(SIDE_COLORS[side]), Safe(" "), words))
    return element("p", *told, class_="legend")


def _chart(quantity: JointQuantity, curves: Drawn) -> Safe:
    drawn = [(side, found) for side, found in curves if found.mean is not None]
    title: list[str] = [element("b", quantity.words), f" [{quantity.unit}]"]
    if not drawn:
        words = element("p", "No stride whose frames all count.", class_="fine")
        return element("figure", element("figcaption", *title), words)
    if any(found.left_out for _, found in curves):
        used = " and ".join(f"{len(found.cycles)} {side}" for side, found in curves)
        title.append(element("small", f" of {used}"))
    label = f"{quantity.words} over the gait cycle, mean and standard deviation"
    plot = element("div", _plot(drawn), class_="plot", role="img", aria_label=label)
    return element("figure", element("figcaption", *title), plot)


def _plot(drawn: Drawn) -> Safe:
    low, high = axis_limits(_reached(drawn))

    def up(value: float) -> float:
        return 100.0 * (1.0 - (value - low) / (high - low))

    ticks = [tick for tick in nice_ticks(low, high, 4) if 4.0 <= up(tick) <= 97.0]
    grid = "".join(
        f"<path d='M0 {up(t):.1f}H{WIDTH:g}' class='{'zero' if t == 0 else 'grid'}'/>" for t in ticks
    )
    lines = "".join(_side(side, curves, low, high) for side, curves in drawn)
    labels = "".join(f"<span style='top:{up(t):.1f}%'>{number(t, high - low)}</span>" for t in ticks)
    percent = "".join(f"<i style='left:{p}%'>{p}</i>" for p in (0, 50, 100))
    return Safe(
        f"<svg viewBox='0 0 {WIDTH:g} {HEIGHT:g}' preserveAspectRatio='none' fill='none'>{grid}{lines}</svg>"
        f"{labels}{percent}"
    )


def _side(side: str, curves: StrideCurves, low: float, high: float) -> str:
    assert curves.mean is not None
    mean, color = curves.mean[SHOWN], SIDE_COLORS[side].on_any_page
    pen = f"style='stroke:{color}' vector-effect='non-scaling-stroke'"
    band = off = ""
    if curves.std is not None:
        path = _band(mean - curves.std[SHOWN], mean + curves.std[SHOWN], low, high)
        band = f"<path d='{path}' style='fill:{color}' fill-opacity='.2'/>"
    if curves.foot_off_share is not None:
        off = f"<path d='M{WIDTH * curves.foot_off_share:.0f} 0V{HEIGHT:g}' {pen} stroke-dasharray='2 3'/>"
    return f"{band}{off}<path d='{curve_path(mean, low, high)}' {pen} stroke-width='1.6'/>"


def _band(
    lower: Float[np.ndarray, " points"], upper: Float[np.ndarray, " points"], low: float, high: float
) -> str:
    x = WIDTH * np.linspace(0.0, 1.0, len(lower))
    around = np.concatenate([x, x[::-1]]), np.concatenate([upper, lower[::-1]])
    y = HEIGHT * (1.0 - (around[1] - low) / (high - low))
    return "M" + " ".join(f"{a:.0f} {b:.1f}" for a, b in zip(around[0], y, strict=True)) + "Z"


def _reached(drawn: Drawn) -> Iterator[float]:
    for _, curves in drawn:
        assert curves.mean is not None
        spread = 0.0 if curves.std is None else curves.std
        yield from (float((curves.mean - spread).min()), float((curves.mean + spread).max()))
