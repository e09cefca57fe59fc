"""The report of one subject: one file that opens offline, plays and prints."""

from collections.abc import Callable, Sequence
from pathlib import Path

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.diagnosis_part import diagnosis_part
from addb_viewer.report.frames_table import frames_part
from addb_viewer.report.joints_part import joints_part
from addb_viewer.report.key_findings import key_findings
from addb_viewer.report.made_from import recorded, repeat_part
from addb_viewer.report.markup import Safe, data_script, element, joined, part, swatch
from addb_viewer.report.moments import moments_of
from addb_viewer.report.motion_part import changed_part, strides_part
from addb_viewer.report.quality import (
    bounds_of,
    held_out_table,
    quality_table,
    stored_list,
    worse_than_markers,
)
from addb_viewer.report.report_page import page_html
from addb_viewer.report.scene_data import arrows_of, plates_of, scene_of
from addb_viewer.report.still_picture import still_picture
from addb_viewer.report.timeline import timeline
from addb_viewer.report.worst_markers import seek_link, worst_markers
from addb_viewer.text.held_out_words import rest_words
from addb_viewer.text.judged_figures import SOURCE
from addb_viewer.trial_view.palette import BLUE, GREEN, INK, ORANGE, PURPLE, RESIDUAL
from addb_viewer.trial_view.recorded_subject import TrialRecord
from solver.capture.atomic import write_whole
from solver.export.gait_tables import gaits_of

PARTS = (
    ("recorded", "What was recorded"),
    ("quality", "Quality"),
    ("frames", "Usable frames"),
    ("scene", "Scene"),
    ("joints", "Joints over the gait cycle"),
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
    gaits, names = gaits_of(recording.fit), [record.replay.name for record in recording.trials]
    contents = {
        "recorded": joined(filter(None, (recorded(recording), strides_part(gaits)))),
        "quality": _quality(report),
        "frames": _frames(report),
        "scene": _scene(report),
        "joints": joints_part(recording.fit, gaits, names),
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
                "repeated without the forces of every third block of 0.22 s or every third whole step, and "
                "has to predict them; six layouts of blocks hold out every known frame but the ends. "
                "For comparison: the markers alone with the fitted mass, low-passed at the cut-off of 3 to "
                "30 Hz that is best on the other frames. All figures are RMS errors. The bounds above are "
                f"{force_N:.0f} N and {moment_Nm:.1f} N·m for this person.",
            ),
            held_out,
        ]
        worse = worse_than_markers(figures)
        if worse is not None:
            pieces += [element("h4", "Where the fit predicts worse than markers alone"), worse]
        rest = rest_words(figures)
        if rest is not None:
            pieces.append(element("p", f"{rest[0].upper()}{rest[1:]}.", class_="fine"))
    return joined(pieces)


def _frames(report: SubjectReport) -> Safe:
    pieces = []
    for index, (record, kept) in enumerate(zip(report.recording.trials, report.kept, strict=True)):
        pieces += [
            element(
                "div", element("h3", record.replay.name), frames_part(record, kept, index), class_="together"
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
