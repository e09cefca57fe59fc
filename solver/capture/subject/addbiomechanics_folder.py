"""AddBiomechanics' upload layout: _subject.json, and a folder of files for each trial."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from solver.capture.capture import TrialFiles
from solver.capture.formats.recording_files import is_recording
from solver.capture.reading_settings import READING, ReadingSettings
from solver.capture.subject.description import Description, read_json
from solver.capture.subject.loose_files import (
    FoundTrials,
    files_in,
    leads_out,
    natural_order,
    reviews_in,
    trials_among,
)
from solver.capture.subject.statics import is_static, moves
from solver.capture.subject.trial_ranges import KEY as RANGES
from solver.capture.subject.trial_ranges import trial_ranges
from solver.common.notes import Kind, Note, noted

USED_KEYS = ("massKg", "heightM", "sex", "ageYears", "footBodyNames", "subjectTags", RANGES)
PROCESSING_KEYS = (  # settings of AddBiomechanics' own server, which mean nothing here
    *("email", "skeletonPreset", "exportSDF", "exportMJCF", "exportMoco", "runMoco", "ignoreJointLimits"),
    *("residualsToZero", "useReactionWheels", "tuneResidualLoss", "shiftGRF", "maxTrialsToSolveMassOver"),
    *("regularizeJointAcc", "dynamicsMarkerOffsets", "dynamicsMarkerWeight", "dynamicsJointWeight"),
    *("dynamicsRegularizePoses", "ignoreFootNotOverForcePlate", "fitDynamics", "disableDynamics"),
    *("segmentTrials", "segmentedTrials", "mergeZeroForceSegmentsThreshold"),
)


def read_subject_json(path: Path) -> Description:
    """Read a _subject.json, in which numbers may stand in quotes.

    Raises:
        CaptureError: broken JSON, or a value of the wrong kind.
    """
    entries = read_json(path)
    mass, mass_notes = entries.number("massKg", "mass")
    height, height_notes = entries.number("heightM", "height")
    age, age_notes = entries.number("ageYears", "age")
    sex, sex_notes = entries.sex("sex")
    notes = mass_notes + height_notes + age_notes + sex_notes
    return Description(
        mass_kg=mass,
        height_m=height,
        sex=sex,
        age_years=age,
        foot_bodies=entries.texts("footBodyNames"),
        tags=entries.texts("subjectTags"),
        ranges=trial_ranges(entries),
        notes=notes + entries.unknown(USED_KEYS + PROCESSING_KEYS),
    )


def trials_of(folder: Path, settings: ReadingSettings = READING) -> FoundTrials:
    """Trials and static trial in SUBJECT/trials/NAME/: markers.trc or .c3d, with grf.mot; else any names."""
    trials: list[TrialFiles] = []
    notes: list[Note] = []
    left: dict[Path, str] = {}
    static: Path | None = None
    for place in sorted((p for p in folder.iterdir() if p.is_dir()), key=lambda p: natural_order(p.name)):
        if place.name.startswith("."):
            continue
        files = {p.name.lower(): p for p in files_in(place)}
        forces = next((files[name] for name in ("grf.mot", "grf.sto") if name in files), None)
        by_need = ("markers.trc", "markers.c3d") if forces else ("markers.c3d", "markers.trc")
        markers = next((files[name] for name in by_need if name in files), None)
        if markers is None and not is_static(place.name):
            found = trials_among(place, [place], settings)
            trials += _named_after(place, found.trials)
            notes += found.notes
            left |= found.left
            static = static or found.static
            if not found.trials:
                notes += noted(
                    Kind.OTHER, f"{folder.name}/{place.name}: no markers.trc or markers.c3d; left out"
                )
        elif is_static(place.name) and not (markers and not leads_out(markers, folder) and moves(markers)):
            markers = markers or next((p for p in files.values() if is_recording(p)), None)
            if markers is None:
                notes += noted(
                    Kind.OTHER, f"{folder.name}/{place.name}: no markers.trc or markers.c3d; left out"
                )
            elif static is None:
                static = markers
            else:
                left[markers] = f"another static trial; {static.parent.name} is used"
                notes += noted(Kind.OTHER, f"{folder.name}/{place.name}: {left[markers]}")
        else:
            assert markers is not None
            trials.append(TrialFiles(place.name, markers, forces, reviews_in(place)))
    return FoundTrials(tuple(trials), static, tuple(notes), left)


def _named_after(place: Path, trials: Sequence[TrialFiles]) -> list[TrialFiles]:
    """Trials with their folder's name; where it holds several, their own behind it."""
    if len(trials) == 1:
        return [replace(trials[0], name=place.name)]
    return [replace(trial, name=f"{place.name}_{trial.name}") for trial in trials]
