"""One trial from its files: read, turned to y up, cleaned, with everything that was assumed on the way."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from solver.capture.axes import VerticalAxis, markers_y_up, plate_y_up, vertical_axis, vertical_axis_named
from solver.capture.capture import Capture, ForcePlate, Markers, TrialFiles
from solver.capture.clock import RATE_TOLERANCE
from solver.capture.formats.b3d.b3d_trial import B3dReview, read_b3d_trial
from solver.capture.formats.b3d.places import SUFFIX
from solver.capture.formats.b3d.stored import StoredPass
from solver.capture.formats.c3d import read_c3d
from solver.capture.formats.qtm_tsv import force_files
from solver.capture.formats.recording_files import (
    MarkersInLab,
    holds_table,
    of_one_person,
    read_forces,
    read_markers,
)
from solver.capture.formats.storage import Storage
from solver.capture.marker_cleaning import MarkerCleaningSettings, clean_markers, join_trajectories
from solver.capture.plates.conditioning import of_a_person, plate_loads
from solver.capture.plates.force_columns import find_plates, turn_table
from solver.capture.plates.force_settings import ConditioningSettings
from solver.capture.plates.loads_under_feet import (
    CONTRADICTION_NATS,
    Feet,
    best_lag_s,
    feet_of,
    loads_of,
    under_feet,
)
from solver.capture.plates.moment_convention import plates_from_storage
from solver.capture.plates.plate_levels import correct_signs_and_levels
from solver.capture.plates.program_artefacts import without_copies, without_edge_zeros
from solver.capture.subject.body_lengths import refuse_no_markers
from solver.capture.subject.review import imported_review, outside_ranges
from solver.common.errors import CaptureError
from solver.common.file_names import readable
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import JUDGED_N

STANDING_M_S, STEP_S = 0.2, 0.3  # of a marker of a foot that stands, and for how long a step does
# a foot's markers are within 0.2 m of its centre of pressure; this far off it isn't under it
NEAR_MARKER_M = 0.5
NEARER_SHARE = 0.5  # of the distance in common axes: only so much nearer do axes of their own count as true
JUDGED_SAMPLES = 50  # loaded ones of a plate, evenly spread, whose distance to markers is judged


@dataclass(frozen=True)
class ReadingSettings:
    """How files become markers and plates."""

    cleaning: MarkerCleaningSettings = field(default_factory=MarkerCleaningSettings)
    conditioning: ConditioningSettings = field(default_factory=ConditioningSettings)


READING = ReadingSettings()


def read_trial(
    files: TrialFiles, settings: ReadingSettings = READING, mass_kg: float | None = None
) -> Capture:
    """Read one trial: metres, newtons, y up, forces on the person, NaN where a marker was not seen.

    A force file that is named beside a C3D file of markers wins over the forces inside that.

    Args:
        files: where it lies, and what a person said about axes and moments.
        settings: thresholds.
        mass_kg: the person's, where it was entered: it helps to tell signs and zero levels of the plates.

    Raises:
        CaptureError: a file cannot be read, or not be understood without a guess.
    """
    recording = read_recording(files)
    markers, cleaning_notes = _cleaned(recording.markers, files.markers, settings)
    mask, reviewed, review_notes = imported_review(files.reviews, markers)
    inner = None if files.inner_review_finished is None else recording.review
    if mask is None and inner is not None:
        mask = inner.missing
    outside, range_notes = outside_ranges(files.ranges, markers)
    possible = [of_a_person(plate, settings.conditioning) for plate in recording.plates]
    measured = [without_edge_zeros(plate) for plate, _ in possible]
    distinct, copy_notes = without_copies([plate for plate, _ in measured])
    copies = {plate.name for plate in recording.plates} - {plate.name for plate in distinct}
    try:
        plates, level_notes = correct_signs_and_levels(
            distinct,
            markers,
            mass_kg,
            settings.conditioning,
            said=[word for word in files.plates if word.name not in copies],
        )
    except CaptureError as error:
        raise CaptureError(f"{files.forces or files.markers}: {error}") from error
    level_notes = (
        *copy_notes,
        *(note for _, notes in (*possible, *measured) for note in notes),
        *level_notes,
    )
    level_notes += _unloaded(plates, feet_of(markers), settings)
    recording = replace(recording, plates=plates)
    source = (files.forces or files.markers).name
    notes = (
        *recording.notes,
        *cleaning_notes,
        *(note.of(source) for note in level_notes),
        *_overlap_notes(recording),
        *_rate_notes(recording),
        *_distance_notes(recording),
        *_contradiction(recording, files),
    )
    return Capture(
        name=files.name,
        markers=markers,
        plates=plates,
        notes=tuple(note.reworded(readable) for note in (*notes, *review_notes, *range_notes)),
        files=(files.markers, *(force_files(files.forces) if files.forces else ()), *files.reviews),
        imported_missing_force=mask,
        imported_reviewed=reviewed,
        outside_ranges=outside,
        stored=recording.stored,
        prefix=recording.prefix,
        imported_reasons=inner.reasons if inner is not None and mask is inner.missing else (),
    )


def read_static(path: Path, settings: ReadingSettings = READING, prefix: str | None = None) -> Capture:
    """Read the markers of a static trial, whatever else its file holds.

    Args:
        path: the file.
        settings: thresholds.
        prefix: before the labels of the person, in a file of several.

    Raises:
        CaptureError: the file cannot be read.
    """
    path = Path(path)
    lab = read_markers(path, None, prefix)
    markers, notes = _cleaned(lab.upright, path, settings)
    notes = (*lab.notes, *lab.up.notes(path.name), *notes)
    said = tuple(note.reworded(readable) for note in notes)
    return Capture(readable(path.stem), markers, (), said, (path,), prefix=lab.whose)


@dataclass(frozen=True)
class Recording:
    """Markers and plates in axes of which y points up."""

    markers: Markers
    plates: tuple[ForcePlate, ...]
    notes: tuple[Note, ...]
    review: B3dReview | None = None  # in the recording's own file
    stored: tuple[StoredPass, ...] = ()
    prefix: str = ""  # before the labels in the file


def read_recording(files: TrialFiles) -> Recording:
    """Markers and plates as their files have them, but for axes and units; nothing is cleaned.

    Args:
        files: where they lie, and what a person said about axes and moments.

    Raises:
        CaptureError: a file cannot be read, or not be understood without a guess.
    """
    up = vertical_axis_named(files.up) if files.up else None
    kind = files.markers.suffix.lower()
    if kind == SUFFIX:
        b3d = read_b3d_trial(files.markers, files.name)
        return Recording(b3d.markers, b3d.plates, b3d.notes, b3d.review, b3d.stored)
    if files.forces in (None, files.markers) and kind == ".c3d":
        c3d = read_c3d(files.markers, up)
        plates = tuple(plate_y_up(plate, c3d.up) for plate in c3d.plates)
        lab = of_one_person(MarkersInLab(c3d.markers, c3d.up, c3d.notes), files.prefix, files.markers)
        return Recording(lab.upright, plates, lab.notes + c3d.up.notes(files.markers.name), prefix=lab.whose)
    lab = read_markers(files.markers, up, files.prefix)
    if files.forces is None and holds_table(files.markers):
        files = replace(files, forces=files.markers)
    if files.forces is None:
        return Recording(lab.upright, (), lab.notes + lab.up.notes(files.markers.name), prefix=lab.whose)
    if kind == ".c3d":
        note = Note(
            Kind.NOT_READ,
            f"{files.markers.name}: forces inside it, if any, are not used: {files.forces.name} is named",
        )
        lab = replace(lab, notes=(*lab.notes, note))
    if files.forces.suffix.lower() == ".c3d":
        c3d = read_c3d(files.forces, up)
        return Recording(
            lab.upright,
            tuple(plate_y_up(plate, c3d.up) for plate in c3d.plates),
            lab.notes + lab.up.notes(files.markers.name) + c3d.notes + c3d.up.notes(files.forces.name),
            prefix=lab.whose,
        )
    return _with_table(lab, files, up)


def _cleaned(markers: Markers, path: Path, settings: ReadingSettings) -> tuple[Markers, tuple[Note, ...]]:
    cleaned, notes = clean_markers(markers, settings.cleaning)
    refuse_no_markers(cleaned, path)
    joined, joining_notes = join_trajectories(cleaned)
    return joined, tuple(note.of(path.name) for note in (*notes, *joining_notes))


def _with_table(lab: MarkersInLab, files: TrialFiles, stated: VerticalAxis | None) -> Recording:
    """Markers with the plates of a table, which mostly are in the same axes as the markers.

    Where markers and forces each say clearly that another axis is vertical, either somebody lies on the floor
    or one of the two files was turned: whichever brings the centres of pressure under the feet is true.
    """
    assert files.forces is not None
    storage = read_forces(files.forces)
    columns = find_plates(storage)[0]
    forces = [storage.values[:, list(plate.force)] for plate in columns]
    corners = [plate.corners for plate in columns if plate.corners is not None]
    of_forces = stated or vertical_axis(None, forces, corners, default=lab.default)
    if files.markers.suffix.lower() == ".c3d":
        return _turned(lab, files, storage, (lab.up, of_forces))
    both = stated or vertical_axis(lab.markers, forces, corners, default=lab.default)
    together = _turned(lab, files, storage, (both, both))
    differ = (lab.up.axis, lab.up.sign) != (of_forces.axis, of_forces.sign)
    if not (differ and lab.up.certain and of_forces.certain):
        return together
    apart = _turned(lab, files, storage, (lab.up, of_forces))
    nearer_m = min(NEAR_MARKER_M, NEARER_SHARE * _distance(together))
    is_nearer = _distance(apart) < nearer_m
    return apart if is_nearer else together


def _turned(
    lab: MarkersInLab, files: TrialFiles, storage: Storage, ups: tuple[VerticalAxis, VerticalAxis]
) -> Recording:
    """Markers and forces turned to y up, each from its own axes."""
    assert files.forces is not None
    upright = turn_table(storage, ups[1].R_ground_lab)
    plates, plate_notes = plates_from_storage(upright, moment_convention=files.moments)
    notes = (*lab.notes, *ups[0].notes(files.markers.name), *plate_notes)
    if ups[0] != ups[1]:
        notes += ups[1].notes(files.forces.name)
    return Recording(markers_y_up(lab.markers, ups[0]), plates, notes, prefix=lab.whose)


def _unloaded(plates: tuple[ForcePlate, ...], feet: Feet, settings: ReadingSettings) -> tuple[Note, ...]:
    """Said of plates that measured nothing at all, and where no plate carried anything."""
    blank = [plate.name for plate in plates if not np.isfinite(plate.force_ground).all(axis=1).any()]
    notes = tuple(
        Note(Kind.OTHER, f"{name}: not one sample has a force: the plate was not recorded") for name in blank
    )
    largest_N = max(
        (float(np.nanmax(plate_loads(plate, settings.conditioning).wrench_ground[:, 1])) for plate in plates),
        default=0.0,
    )
    if not plates or len(blank) == len(plates) or largest_N >= settings.conditioning.threshold_N:
        return notes
    stood_on = [plate.name for plate in plates if _stands_on(feet, plate)]
    if stood_on:
        return (
            *notes,
            Note(
                Kind.OTHER,
                f"no plate carries a load at any time, though feet stand on {', '.join(stood_on)}: the "
                "plates were not recorded. No force of this trial counts; were the amplifiers on?",
            ),
        )
    return (
        *notes,
        Note(
            Kind.OTHER,
            "no plate carries a load at any time: did the person step on none, or is the file of "
            "another trial?",
        ),
    )


def _stands_on(feet: Feet, plate: ForcePlate) -> bool:
    """Whether low markers of a foot stay within the plate's corners for as long as a step takes."""
    if plate.corners_ground is None or len(feet.times) < 2:
        return False
    corners = plate.corners_ground[:, [0, 2]]
    speed = np.linalg.norm(np.gradient(feet.positions, axis=0), axis=2) * feet.rate
    with np.errstate(invalid="ignore"):
        inside = ((feet.positions > corners.min(axis=0)) & (feet.positions < corners.max(axis=0))).all(axis=2)
        stands = (inside & (speed < STANDING_M_S)).any(axis=1)
    return bool(stands.sum() >= STEP_S * feet.rate)


def _overlap_notes(recording: Recording) -> tuple[Note, ...]:
    times = recording.markers.times
    apart = [p.name for p in recording.plates if p.times[0] > times[-1] or p.times[-1] < times[0]]
    if not apart:
        return ()
    return noted(
        Kind.OTHER,
        f"{', '.join(apart)}: recorded at other times than the markers ({times[0]:g} to {times[-1]:g} s): "
        "do the files belong together?",
    )


def _rate_notes(recording: Recording) -> tuple[Note, ...]:
    """Plates are sampled at least as fast as cameras; a slower one may have sample numbers for times."""
    least = recording.markers.rate * (1 - RATE_TOLERANCE)
    return tuple(
        Note(
            Kind.OTHER,
            f"{plate.name}: sampled at {plate.rate:.6g} Hz, more slowly than the markers "
            f"({recording.markers.rate:.6g} Hz): is its time column in seconds?",
        )
        for plate in recording.plates
        if plate.rate < least
    )


def _distance_notes(recording: Recording) -> tuple[Note, ...]:
    distance = _distance(recording)
    if not np.isfinite(distance) or distance < NEAR_MARKER_M:
        return ()
    return noted(
        Kind.OTHER,
        f"the centres of pressure are {distance:.1f} m from the nearest marker: are markers and forces in "
        "the same axes, and do the files belong together?",
    )


def _contradiction(recording: Recording, files: TrialFiles) -> tuple[Note, ...]:
    """Said of a force file whose loads do not lie under the feet that the markers show."""
    loads = loads_of(recording.plates)
    if files.forces is None or loads is None:
        return ()
    feet = feet_of(recording.markers)
    found = under_feet(feet, loads)
    if found.log_odds > CONTRADICTION_NATS:
        return ()
    lag_s = best_lag_s(feet, loads)
    moved = f" They would fit {abs(lag_s):.2f} s {'later' if lag_s > 0 else 'earlier'}." if lag_s else ""
    return noted(
        Kind.OTHER,
        f"{files.forces.name}: its loads do NOT lie under the feet of {files.markers.name} (typically "
        f"{100 * found.off_m:.0f} cm off): are they of another trial or clock, or in other axes?{moved} "
        "Check which files belong together before you use any torque.",
    )


def _distance(recording: Recording) -> float:
    """How far loaded centres of pressure typically are from the nearest marker [m]; infinite without any."""
    markers, nearest = recording.markers, []
    for plate in recording.plates:
        frames = np.round((plate.times - markers.start_time) * markers.rate).astype(int)
        known = np.isfinite(plate.cop_ground).all(axis=1) & (frames >= 0) & (frames < markers.frames)
        loaded = np.flatnonzero(known & (np.abs(plate.force_ground[:, 1]) > JUDGED_N))
        sample = loaded[:: max(1, len(loaded) // JUDGED_SAMPLES)]
        away = np.linalg.norm(
            markers.positions_ground[frames[sample]] - plate.cop_ground[sample, None], axis=2
        )
        nearest += np.where(np.isfinite(away), away, np.inf).min(axis=1, initial=np.inf).tolist()
    return float(np.median(nearest)) if nearest else float("inf")
