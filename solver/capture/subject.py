"""A subject's folder, in AddBiomechanics' layout, with a subject.toml, or with files side by side."""

from pathlib import Path

from solver.capture.addbiomechanics_folder import read_subject_json, trials_of
from solver.capture.capture import Subject
from solver.capture.description import Description
from solver.capture.loose_files import files_in, find_model, loose_trials
from solver.capture.subject_toml import read_subject_toml
from solver.capture.trial_ranges import with_ranges
from solver.errors import CaptureError

MARKER_MAP = "markers.toml"  # in the subject's folder: what its labels mean


def open_subject(folder: Path) -> Subject:
    """Find out who was recorded, with which model, in which trials. Recordings are not read yet.

    A subject.toml says it all; _subject.json fills in what it leaves out; where neither names trials, they
    are looked for in trials/NAME/, else among the folder's own files.

    Raises:
        CaptureError: no such folder, no trial in it, or a description that is broken or names missing files.
    """
    folder = Path(folder)
    if not folder.is_dir():
        mend = f"Give its folder: {folder.parent}." if folder.is_file() else "Check the spelling of the path."
        raise CaptureError(f"{folder}: no folder of that name. {mend}")
    described = Description()
    by_hand, uploaded = folder / "subject.toml", folder / "_subject.json"
    try:
        if by_hand.is_file():
            described = described.or_else(read_subject_toml(by_hand))
        if uploaded.is_file():
            described = described.or_else(read_subject_json(uploaded))
        if described.trials is None:
            described = described.or_else(_trials(folder))
        model = described.model or (None if by_hand.is_file() else find_model(folder))
        unused = [p.name for p in files_in(folder) if p.suffix.lower() == ".osim" and model is None]
    except PermissionError as error:
        raise CaptureError(f"{error.filename}: cannot be read ({error.strerror}).") from error
    if described.trials is None:
        raise CaptureError(f"{folder}: no trials. {_what_was_sought(folder)}")
    trials, range_notes = with_ranges(described.trials, described.ranges)
    notes = described.notes + range_notes
    if unused:
        notes += (f"subject.toml names no model: {', '.join(unused)} not used, the default body is",)
    return Subject(
        folder=folder,
        trials=trials,
        mass_kg=described.mass_kg,
        height_m=described.height_m,
        sex=described.sex,
        age_years=described.age_years,
        model=model,
        static=described.static,
        marker_map=folder / MARKER_MAP if (folder / MARKER_MAP).is_file() else None,
        foot_bodies=described.foot_bodies or Subject.foot_bodies,
        tags=described.tags or (),
        notes=notes,
    )


def _trials(folder: Path) -> Description:
    if (folder / "trials").is_dir():
        in_trials = trials_of(folder / "trials")
        if in_trials.trials is not None:
            return in_trials
    return loose_trials(folder)


def _what_was_sought(folder: Path) -> str:
    below = sum(p.suffix.lower() in (".trc", ".c3d") and p.parent != folder for p in folder.rglob("*"))
    found = f" {below} marker files lie elsewhere in it." if below else ""
    return (
        "Put files into trials/NAME/markers.trc, or X.trc beside X_grf.mot, or X.c3d, or name them in a "
        f"subject.toml.{found}"
    )
