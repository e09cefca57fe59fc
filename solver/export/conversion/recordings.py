"""C3D files, and .trc files with or without a table of forces, as their makers recorded them.

Only axes and signs are made alike: y up, forces on the person. Spikes, gaps and zero levels stay.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from solver.capture.capture import ForcePlate, Markers, TrialFiles
from solver.capture.formats.analog_channels import analog_in
from solver.capture.formats.c3d_contents import foot_events, open_c3d
from solver.capture.formats.qtm_tsv import plates_beside
from solver.capture.formats.recording_files import is_recording, loads_upright, read_forces
from solver.capture.formats.text_table import some_of
from solver.capture.formats.trc import write_trc
from solver.capture.plates.moment_convention import plates_from_storage
from solver.capture.plates.plate_levels import evidence_on_plates
from solver.capture.trial import READING, ReadingSettings, read_recording
from solver.export.c3d_file import C3dRecording, ModelOutput, joint_outputs, write_c3d
from solver.export.conversion.file_content import Content, Trial
from solver.export.conversion.opensim_set import by_clock, write_plates

LISTED = 6  # names in a message


def read_marker_file(path: Path, forces: Path | None = None, settings: ReadingSettings = READING) -> Content:
    """A file of markers, with its own forces, or those of another file where one is named.

    Raises:
        CaptureError: a file cannot be read.
    """
    if forces is None:
        forces = plates_beside(path)
    found = read_recording(TrialFiles(path.stem, path, forces))
    plates, sign_notes = on_the_person(found.plates, found.markers, settings)
    trial = Trial(path.stem, found.markers, plates)
    content = Content(path, (trial,), notes=(*found.notes, *sign_notes))
    return _with_the_rest_of_c3d(content) if path.suffix.lower() == ".c3d" else content


def read_force_table(path: Path) -> Content:
    """A file of ground forces, y up.

    Raises:
        CaptureError: the file cannot be read, or has no columns of ground forces.
    """
    storage = read_forces(path)
    if storage.plates:  # a text export is in the laboratory's axes, tables are y up
        storage = loads_upright(storage)
    plates, notes = plates_from_storage(storage)
    return Content(path, (Trial(path.stem, plates=plates),), notes=notes)


def read_text_export(path: Path, settings: ReadingSettings = READING) -> Content:
    """A .tsv, .csv or .txt file of a capture program: markers and what forces belong to it, or forces.

    Raises:
        CaptureError: the file cannot be read, or is no such export.
    """
    if is_recording(path):
        return read_marker_file(path, None, settings)
    return read_force_table(path)


def on_the_person(
    plates: Sequence[ForcePlate], markers: Markers, settings: ReadingSettings
) -> tuple[tuple[ForcePlate, ...], tuple[str, ...]]:
    """The plates, those turned round that clearly read the force on the plate; their zero levels stay."""
    if not plates:
        return (), ()
    evidence_by_plate = evidence_on_plates(plates, markers, None, settings.conditioning)
    turned, notes = [], []
    for plate, evidence in zip(plates, evidence_by_plate, strict=True):
        if evidence.is_turned():
            notes.append(f"{plate.name}: reads the force on the plate; it is turned to act on the person")
            force, moment = -plate.force_ground, -plate.moment_ground
            turned.append(replace(plate, force_ground=force, moment_ground=moment))
            continue
        if evidence.is_undecided():
            notes.append(f"{plate.name}: which way its force counts is not clear; left as it is")
        turned.append(plate)
    return tuple(turned), tuple(notes)


def _with_the_rest_of_c3d(content: Content) -> Content:
    """Events, analog channels that are no plate's, and what else the file holds that no format takes."""
    contents = open_c3d(content.source)
    events, others = foot_events(contents)
    (trial,) = content.trials
    mass, height = (contents.number("PROCESSING", name, 0.0) for name in ("BODYMASS", "HEIGHT"))
    return replace(
        content,
        trials=(replace(trial, events=events, analog=analog_in(contents)),),
        mass_kg=mass or None,
        height_m=height / 1000 or None,
        left_behind=(f"{len(others)} events ({some_of(others, LISTED)})",) if others else (),
    )


def write_c3d_file(content: Content, path: Path) -> tuple[str, ...]:
    """Write one trial's markers, plates and events, and what its motion says, as `export` does."""
    (trial,) = content.trials
    assert trial.markers is not None
    outputs: tuple[ModelOutput, ...] = ()
    notes: tuple[str, ...] = ()
    if trial.motion is not None and content.skeleton is not None:
        if trial.motion.frames == trial.markers.frames:
            outputs = joint_outputs(content.skeleton, trial.motion, trial.torques)
        else:
            notes = (f"{path.name}: the motion has other frames than the markers, and is left out",)
    recording = C3dRecording(
        markers=trial.markers,
        plates=trial.plates,
        events=trial.events,
        outputs=outputs,
        subject=content.source.stem,
        mass_kg=content.mass_kg,
        height_m=content.height_m,
        analog=trial.analog,
    )
    return (*notes, *write_c3d(path, recording))


def write_trc_file(content: Content, path: Path) -> tuple[str, ...]:
    """Write one trial's markers, and beside them STEM_grf.mot with its plates."""
    (trial,) = content.trials
    assert trial.markers is not None
    write_trc(path, trial.markers)
    return write_mot(content, path.with_name(f"{path.stem}_grf.mot")) if trial.plates else ()


def write_mot(content: Content, path: Path) -> tuple[str, ...]:
    """Write one trial's plates; those of other clocks into STEM_2.mot and so on."""
    (trial,) = content.trials
    groups = by_clock(trial.plates)
    for number, plates in enumerate(groups, start=1):
        write_plates(path if number == 1 else path.with_stem(f"{path.stem}_{number}"), plates)
    notes = []
    if len(groups) > 1:
        notes.append(f"{path.name}: plates have {len(groups)} clocks, and a file for each")
    cornered = [plate.name for plate in trial.plates if plate.corners_ground is not None]
    if cornered:
        notes.append(f"{path.name}: has no place for the corners of {', '.join(cornered)}")
    return tuple(notes)
