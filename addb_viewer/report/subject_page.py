"""The report of one subject: one file that opens offline, plays and prints."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.frames_kept import Kept, decided_by, duration_s, frames_words, seconds_words
from addb_viewer.report.joints_part import angles_part, joints_part
from addb_viewer.report.key_findings import key_findings
from addb_viewer.report.made_from import recorded, repeat_part
from addb_viewer.report.markup import Safe, bar, data_script, element, joined, part, swatch, table, told
from addb_viewer.report.motion_part import changed_part, moments_of, strides_part
from addb_viewer.report.quality import (
    bounds_of,
    held_out_table,
    quality_table,
    seek_link,
    stored_list,
    worse_than_markers,
    worst_markers,
)
from addb_viewer.report.report_page import page_html
from addb_viewer.report.scene_data import arrows_of, plates_of, scene_of
from addb_viewer.report.still_picture import still_picture
from addb_viewer.report.timeline import diagnosed_timeline, timeline
from addb_viewer.text.amounts import TO_95
from addb_viewer.text.coordinate_words import torque_in_words
from addb_viewer.text.diagnosis_words import NOTES, page
from addb_viewer.text.extension_words import what_accepting_changes
from addb_viewer.text.holding_up_words import what_it_gains
from addb_viewer.text.judged_figures import SOURCE
from addb_viewer.text.residual_words import what_is_wrong
from addb_viewer.trial_view.palette import BLUE, GREEN, INK, ORANGE, PURPLE, RESIDUAL, reason_color
from addb_viewer.trial_view.recorded_subject import TrialRecord
from annotations.foot_names import foot_words
from solver.capture.atomic import write_whole
from solver.diagnosis.diagnosis import Gain
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.export.gait_tables import gaits_of
from solver.fitting.fit_result import StanceInfluence


def frames_part(
    record: TrialRecord, kept: Kept, index: int, influences: Sequence[StanceInfluence] = ()
) -> Safe:
    """A sentence and a table, and the torques that rest on the force of one stance elsewhere.

    Args:
        record: the trial.
        kept: its frames.
        index: of it in the report.
        influences: of the trial's stances.
    """
    replay = record.replay
    rows = [
        (
            joined((swatch(GREEN), Safe(" "), "usable")),
            "both feet",
            *_sizes(kept.ranges, kept.count, kept.frames, replay.rate),
            _places(kept.ranges, replay.times, index),
        )
    ]
    for cause in kept.causes:
        rows.append(
            (
                joined(
                    (
                        swatch(reason_color(cause.reason)),
                        Safe(" "),
                        f"left out: {cause.words}",
                        element("small", cause.meaning) if cause.meaning else Safe(""),
                    )
                ),
                cause.foot_words,
                *_sizes(cause.ranges, cause.frames, kept.frames, replay.rate),
                _places(cause.ranges, replay.times, index),
            )
        )
    said = [f"{kept.count} of {kept.frames} frames are usable ({_seconds(kept.ranges, replay.rate)})."]
    if kept.contacts is not None:
        measured, of = kept.contacts
        said.append(f"Plates carry the foot in {measured} of the {of} times that one stands on the ground.")
    said.append(f"Who decided: {decided_by(record.figures.mask_source, kept)}.")
    head = ("Frames are …", "Foot", "Frames", "Time", "Where: frames, seconds on the recording's clock")
    resting = [_resting(found, replay.times, index) for found in influences]
    return joined((element("p", " ".join(said)), table(head, rows, "frames"), *filter(None, resting)))


def _resting(found: StanceInfluence, times: Float[np.ndarray, " frames"], index: int) -> Safe | None:
    """That a torque would leave its band without the force of a stance on other frames; None: none would."""
    half = TO_95 * found.std
    if abs(found.change) <= half:
        return None
    stance = seek_link(index, found.frames[0], frames_words(*found.frames))
    at = seek_link(index, found.at_frame, f"frame {found.at_frame}, {times[found.at_frame]:.2f} s")
    return element(
        "p",
        f"The {torque_in_words(found.dof)} at ",
        at,
        f" rests on the {foot_words(found.foot)} stance of frames ",
        stance,
        f": without its force it would differ by {abs(found.change):.0f} N·m; its band is ± {half:.0f} N·m.",
    )


def _sizes(ranges: tuple[tuple[int, int], ...], count: int, of: int, rate: float) -> tuple[Safe, str]:
    share = element("small", f"{100 * count / max(of, 1):.0f} %")
    return joined((str(count), Safe(" "), share)), _seconds(ranges, rate)


def _seconds(ranges: tuple[tuple[int, int], ...], rate: float) -> str:
    return f"{duration_s(ranges, rate):.2f} s"


def _places(ranges: tuple[tuple[int, int], ...], times: Float[np.ndarray, " frames"], index: int) -> Safe:
    """Each range with a link to its first frame."""
    if not ranges:
        return Safe("nowhere")
    return joined(
        (
            element(
                "span",
                seek_link(index, start, frames_words(start, end)),
                Safe(" "),
                element("small", seconds_words(start, end, times)),
                class_="range",
            )
            for start, end in ranges
        ),
        between=" ",
    )


BARS = (  # what, its key, unit, factor, decimals
    ("Force missed", "held_out_linear_residual_N", "N", 1.0, 0),
    ("Moment missed", "held_out_angular_residual_Nm", "N·m", 1.0, 1),
    ("Marker error", "marker_rms_m", "mm", 1e3, 1),
)


def diagnosis_part(report: SubjectReport) -> Safe:
    """All that a stored diagnosis says; or that there is none."""
    shown = report.diagnosis
    if shown.figures is None:
        return element("p", shown.absent)
    after: dict[str, list[Safe]] = {
        what_is_wrong(shown.figures).heading: _timelines(report, shown.figures),
        what_it_gains(shown.figures).heading: [gain_bars(shown.figures.gain)],
    }
    pieces: list[Safe] = []
    for section in page(shown.figures):
        if section.heading != NOTES:  # those stand among the report's own
            pieces += [told(section), *after.get(section.heading, ())]
    if shown.decision:
        pieces.append(element("p", shown.decision))
    if shown.gain is not None:
        pieces.append(told(what_accepting_changes(shown.gain)))
    return joined(pieces)


def gain_bars(gain: Mapping[str, Gain]) -> Safe:
    """Each figure on hidden stretches without and with the causes, as bars of a common scale."""
    groups = []
    for label, key, unit, factor, digits in BARS:
        if key not in gain:
            continue
        before, after = (factor * figure for figure in (gain[key].before, gain[key].after))
        most = max(before, after, 1e-12)
        bars = [
            element(
                "div", element("span", words), bar(v / most, kind), element("b", f"{v:.{digits}f} {unit}")
            )
            for words, kind, v in (("without", "before", before), ("with", "after", after))
        ]
        groups.append(element("figure", element("figcaption", label), *bars))
    return element("div", *groups, class_="gains")


def _timelines(report: SubjectReport, figures: DiagnosisReport) -> list[Safe]:
    drawn: list[Safe] = []
    several = len(report.recording.trials) > 1
    for index, record in enumerate(report.recording.trials):
        chart = diagnosed_timeline(record, index, figures)
        if chart is not None:
            name = f"{record.replay.name}. " if several else ""
            beside = "without and with the named causes" if figures.effects else "against what is ordinary"
            words = f"{name}The recording's own residual over time, {beside}"
            drawn.append(element("figure", element("figcaption", words), chart))
    return drawn


PARTS = (
    ("recorded", "What was recorded"),
    ("quality", "Quality"),
    ("frames", "Usable frames"),
    ("scene", "Scene"),
    ("joints", "Joints over the gait cycle"),
    ("angles", "Joint angles by conventions"),
    ("markers", "Worst markers"),
    ("diagnosis", "Diagnosis"),
    ("notes", "Notes"),
    ("repeat", "To repeat this"),
)

OVER_TIME = (
    "Residuals where they count, marker errors and plate forces over time, and below them which frames are "
    "usable. Grey: left out. ▲: how far a curve goes beyond its axis."
)
ON_CLICK = element("span", " A click leads the player there.", class_="only-screen")
PLAYER = ("player_numbers.js", "player_shapes.js", "player.js")  # in the order of their use
SPEEDS = ("0.1", "0.25", "0.5", "1", "2")


def subject_page(report: SubjectReport) -> str:
    """The page's HTML."""
    recording = report.recording
    gaits, figures = (
        gaits_of(recording.fit),
        {record.replay.name: record.figures for record in recording.trials},
    )
    contents = {
        "recorded": joined(filter(None, (recorded(recording), strides_part(gaits)))),
        "quality": _quality(report),
        "frames": _frames(report),
        "scene": _scene(report),
        "joints": joints_part(recording.fit, gaits, figures),
        "angles": angles_part(recording.fit, figures),
        "markers": _markers(report),
        "diagnosis": diagnosis_part(report),
        "notes": _notes(report),
        "repeat": repeat_part(recording),
    }
    shown = [(name, words, content) for name, words in PARTS if (content := contents[name]) is not None]
    version = recording.fit.provenance.get("addb-viewer", "")
    head = element(
        "header",
        element("h1", recording.subject),
        element("p", f"Report of {report.made:%Y-%m-%d %H:%M}, addb-viewer {version}", class_="made"),
        element(
            "nav", *(element("a", words, href=f"#{name}") for name, words, _ in shown), aria_label="Parts"
        ),
    )
    parts = [part(name, words, content) for name, words, content in shown]
    data = data_script("scene-data", scene_of(recording, report.kept))
    body = joined((head, element("main", key_findings(report), *parts), data))
    return page_html(f"{recording.subject} — addb-viewer report", body, PLAYER)


def write_report(
    report: SubjectReport, file: Path, page: Callable[[SubjectReport], str] = subject_page
) -> Path:
    """Write the report in place of the file that was there; all of it or nothing.

    Args:
        report: of one trial or more.
        file: its folder must exist.
        page: makes its HTML: the whole report, or the form on one page.

    Returns:
        The file.

    Raises:
        CaptureError: the folder cannot be written to.
    """
    write_whole(file, page(report))
    return file


def _quality(report: SubjectReport) -> Safe:
    figures = [record.figures for record in report.recording.trials]
    pieces = [
        quality_table(figures),
        element(
            "p",
            f"Bounds of {SOURCE}. Residual: the wrench that is missing for F = ma, RMS over the frames that "
            "count; the moment about the root joint's centre, in the ground frame. 1 BW: the fitted mass "
            "× 9.80665 m/s²; h: the height. Marker errors: over all frames, unfiltered.",
            class_="fine",
        ),
    ]
    if predicted := [of.name for of in figures if of.forces_predicted]:
        pieces.append(
            element(
                "p",
                f"{', '.join(predicted)}: no measured force is used. Ground forces and joint torques are "
                "predicted from the motion and the mass. No measurement confirms them, and there is no "
                "residual.",
            )
        )
    if (stored := stored_list(figures)) is not None:
        pieces += [element("h3", "Figures stored in the recording's file"), stored]
    pieces.append(changed_part(figures))
    held_out = held_out_table(figures)
    force_N, moment_Nm = bounds_of(report.recording.fit.mass_kg, report.recording.fit.height_m)
    if held_out is not None:
        pieces += [
            element("h3", "Held-out forces"),
            element(
                "p",
                "A low residual alone proves nothing: distorting the motion lowers it, too. So the fit is "
                "judged by the step that it would take without the forces of every third block of 0.22 s or "
                "every third whole step: what it then misses of them. Six layouts of blocks hold out every "
                "known frame but the ends. "
                "For comparison: the markers alone with the fitted mass, low-passed at the cut-off of 3 to "
                "30 Hz that is best on the other frames. All figures are RMS errors. The bounds above are "
                f"{force_N:.0f} N and {moment_Nm:.1f} N·m for this person.",
            ),
            held_out,
        ]
        worse = worse_than_markers(figures)
        if worse is not None:
            pieces += [element("h4", "Where the fit predicts worse than markers alone"), worse]
    return joined(pieces)


def _frames(report: SubjectReport) -> Safe:
    pieces = []
    for index, (record, kept) in enumerate(zip(report.recording.trials, report.kept, strict=True)):
        pieces += [
            element(
                "div",
                element("h3", record.replay.name),
                frames_part(
                    record,
                    kept,
                    index,
                    [found for found in report.influences if found.trial == record.replay.name],
                ),
                class_="together",
            ),
            element(
                "figure",
                element("figcaption", f"{OVER_TIME}{_compared(record)}", ON_CLICK),
                timeline(record, index, report.recording.diagnosis),
            ),
        ]
    return joined(pieces)


def _compared(record: TrialRecord) -> str:
    return f" Dotted: {record.before_name}." if record.before is not None else ""


def _scene(report: SubjectReport) -> Safe:
    recording, kept = report.recording, report.kept
    pieces, first = [], 0
    for index, (record, its_frames) in enumerate(zip(recording.trials, kept, strict=True)):
        replay = record.replay
        arrows, plates = arrows_of(replay, recording.diagnosis), plates_of(replay)
        stills = []
        moments = moments_of(replay, its_frames, recording.diagnosis)
        for moment in moments:
            caption = joined(
                (
                    element("b", moment.heading),
                    Safe(" "),
                    seek_link(
                        index, moment.frame, f"frame {moment.frame}, {replay.times[moment.frame]:.2f} s"
                    ),
                    element("small", moment.why),
                )
            )
            drawn = still_picture(replay, moment.frame, recording.meshes, arrows, plates)
            stills.append(element("figure", drawn, element("figcaption", caption)))
        if index == 0 and moments:
            first = moments[-1].frame
        heading = [element("h3", replay.name)] if len(recording.trials) > 1 else []
        pieces.append(element("div", *heading, element("div", *stills, class_="stills"), class_="together"))
    names = [record.replay.name for record in recording.trials]
    told = element("p", "The scene plays where this file is opened in a browser.", class_="only-print")
    return joined((player_html(names, first), told, _legend(), *pieces))


def _legend() -> Safe:
    keys = (
        (GREEN, "force on the right foot"),
        (PURPLE, "on the left foot"),
        (ORANGE, "of no foot"),
        (INK, "dashed: required by the motion, not measured"),
        (RESIDUAL, "residual, at the centre of mass"),
        (BLUE, "markers: blue fits, vermilion is 4 cm off"),
    )
    items = [element("span", swatch(color), Safe(" "), words) for color, words in keys]
    return element(
        "p",
        *items,
        Safe("Forces: 1 m for 1000 N. On the floor: plates, dotted where their force acted."),
        class_="legend",
    )


def _markers(report: SubjectReport) -> Safe:
    pieces: list[Safe] = []
    several = len(report.recording.trials) > 1
    for index, record in enumerate(report.recording.trials):
        heading = [element("h3", record.replay.name)] if several else []
        pieces.append(element("div", *heading, worst_markers(record.replay, index), class_="together"))
    return joined(pieces)


def _notes(report: SubjectReport) -> Safe:
    diagnosis = report.recording.diagnosis
    notes = dict.fromkeys((*report.recording.notes, *(diagnosis.notes if diagnosis else ())))
    if not notes:
        return element("p", "Nothing was assumed or ignored.")
    lead = element("p", "What was assumed, converted or ignored on the way from the files to these figures:")
    return joined((lead, element("ul", *(element("li", note) for note in notes))))


def player_html(trials: Sequence[str], frame: int) -> Safe:
    """Picture, bar and buttons.

    Args:
        trials: their names.
        frame: of the first one, that is shown first.
    """
    choices = [element("option", name, value=str(i)) for i, name in enumerate(trials)]
    speeds = [Safe(f'<option value="{s}"{" selected" if s == "1" else ""}>{s} ×</option>') for s in SPEEDS]
    hidden = {} if len(trials) > 1 else {"hidden": "hidden"}
    picture = element(
        "div",
        Safe(
            '<canvas data-role="canvas" tabindex="0" role="img" aria-label="Playable 3-D scene; arrow keys '
            'go from frame to frame, space plays"></canvas>'
        ),
        element("div", "", class_="status", data_role="status", aria_live="off"),
        element("p", "Loading the scene …", class_="message", data_role="message"),
        class_="picture",
    )
    bar = element(
        "div",
        Safe('<div class="marks" data-role="marks"></div>'),
        Safe('<input type="range" data-role="bar" min="0" value="0" step="1" aria-label="Frame">'),
        class_="scrub",
    )
    controls = element(
        "div",
        element("button", "▶ Play", type="button", data_role="play"),
        element("output", "", data_role="where"),
        element("label", "Speed ", element("select", *speeds, data_role="speed")),
        element("label", "Trial ", element("select", *choices, data_role="trial"), **hidden),
        element("label", Safe('<input type="checkbox" data-role="follow" checked>'), " follow"),
        element("button", "Reset view", type="button", data_role="home"),
        class_="controls",
    )
    return element("div", picture, bar, controls, id="player", data_frame=str(frame))
