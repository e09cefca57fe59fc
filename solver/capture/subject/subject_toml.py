"""subject.toml: any layout of files, described by hand."""

import math
from pathlib import Path

from solver.capture.capture import PlateWord, TrialFiles
from solver.capture.plates.moment_convention import CONVENTIONS
from solver.capture.subject.description import Description, Entries, read_toml
from solver.capture.subject.release_words import release_words
from solver.common.errors import CaptureError
from solver.common.notes import Note

KEYS = (
    "mass_kg",
    "height_m",
    "sex",
    "age_years",
    "model",
    "model_is",
    "foot_bodies",
    "static",
    "tags",
    "prefix",
    "trials",
    "release",
)
TRIAL_KEYS = ("markers", "forces", "review", "up", "moments", "plates")
MODEL_WORDS = ("scaled", "generic")
READS = {"person": 1, "plate": -1}


def read_subject_toml(path: Path, model_words: tuple[str, ...] = MODEL_WORDS) -> Description:
    """Read a subject.toml.

    Args:
        path: of the file.
        model_words: what may be said of the model.

    Raises:
        CaptureError: broken TOML, a value of the wrong kind, or a file that is missing or outside the folder.
    """
    entries = read_toml(path)
    mass, mass_notes = entries.number("mass_kg", "mass")
    height, height_notes = entries.number("height_m", "height")
    age, age_notes = entries.number("age_years", "age")
    sex, sex_notes = entries.sex("sex")
    trials, trial_notes = _trials(entries)
    release, release_notes = release_words(entries)
    notes = mass_notes + height_notes + age_notes + sex_notes + trial_notes + release_notes
    return Description(
        mass_kg=mass,
        height_m=height,
        sex=sex,
        age_years=age,
        foot_bodies=entries.texts("foot_bodies"),
        tags=entries.texts("tags"),
        model=entries.file("model"),
        model_is=entries.word("model_is", model_words),
        static=entries.file("static"),
        trials=trials,
        release=release,
        prefix=entries.text("prefix"),
        notes=notes + entries.unknown(KEYS),
    )


def can_name_a_trial(name: str) -> bool:
    """Whether files can be called after it."""
    return bool(name.strip()) and not name.startswith(".") and "/" not in name and "\\" not in name


def _trials(entries: Entries) -> tuple[tuple[TrialFiles, ...] | None, tuple[Note, ...]]:
    tables = entries.values.get("trials")
    if tables is None:
        return None, ()
    if not isinstance(tables, dict) or not tables:
        raise CaptureError(
            f'{entries.path}: trials are tables of their own: [trials.NAME], then markers = "FILE".'
        )
    trials: list[TrialFiles] = []
    notes: tuple[Note, ...] = ()
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise CaptureError(
                f"{entries.path}: trials.{name} is no table. Write [trials.{name}] above its keys."
            )
        if not can_name_a_trial(name):
            raise CaptureError(
                f"{entries.path}: trial '{name}': results are filed under that name; leave out / and \\."
            )
        trial = Entries(entries.path, table, f"trials.{name}.")
        markers = trial.file("markers")
        if markers is None:
            raise CaptureError(f'{entries.path}: trials.{name} has no markers. Add markers = "FILE.trc".')
        trials.append(
            TrialFiles(
                name=name,
                markers=markers,
                forces=trial.file("forces"),
                reviews=trial.files("review"),
                up=trial.word("up", ("x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z")),
                moments=trial.word("moments", CONVENTIONS),
                plates=_plates(trial),
            )
        )
        notes += trial.unknown(TRIAL_KEYS)
    return tuple(trials), notes


def _plates(trial: Entries) -> tuple[PlateWord, ...]:
    """What is said of a trial's force plates."""
    tables = trial.values.get("plates", {})
    if not isinstance(tables, dict) or not all(isinstance(table, dict) for table in tables.values()):
        raise trial.complaint("plates", 'plates are tables of their own: [trials.NAME.plates."PLATE"].')
    words = []
    for name, table in tables.items():
        plate = Entries(trial.path, table, f"{trial.prefix}plates.{name}.")
        for key in table:
            if key not in ("reads", "zero_N"):
                raise plate.complaint(key, "a plate has no other keys than reads and zero_N.")
        zero = table.get("zero_N")
        is_number = isinstance(zero, int | float) and not isinstance(zero, bool) and math.isfinite(zero)
        if zero is not None and not is_number:
            raise plate.complaint("zero_N", "a number of newtons is needed, in the file's own sign.")
        reads = plate.word("reads", tuple(READS))
        words.append(PlateWord(name, READS[reads] if reads else None, None if zero is None else float(zero)))
    return tuple(words)
