"""A .b3d file as a subject: who was recorded, with which model, in which trials."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from solver.capture.capture import Subject, TrialFiles
from solver.capture.formats.b3d.b3d_fields import B3dFile, Header
from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.capture.formats.b3d.b3d_trial import review_of, trials_in
from solver.capture.subject.description import LARGEST, SEXES, Description
from solver.capture.subject.subject_toml import MODEL_WORDS, read_subject_toml
from solver.capture.subject.unused_files import unused_files
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note
from solver.common.small_files import BrokenFileError, lies_there

DESCRIBED_BY_HAND = "subject.toml"
MARKER_MAP = "markers.toml"
STORED = "stored"  # the model in the file, its scales kept; "generic" scales its shape anew
DEFAULT_BODY = "default"  # the program's own body in its place


def open_b3d_subject(folder: Path, file: Path) -> Subject:
    """The subject that a .b3d file holds.

    What a subject.toml in its folder of decisions says goes before the file's header.

    Args:
        folder: of decisions; it need not be there.
        file: the recording.

    Raises:
        CaptureError: the file is damaged, holds no trial with markers, or a description is broken.
    """
    b3d = read_b3d(file)
    by_hand, marker_map = folder / DESCRIBED_BY_HAND, folder / MARKER_MAP
    try:
        stated = (
            read_subject_toml(by_hand, (*MODEL_WORDS, DEFAULT_BODY)) if lies_there(by_hand) else Description()
        )
        has_map = lies_there(marker_map)
    except BrokenFileError as error:
        raise CaptureError(f"{folder}: {error}") from error
    except PermissionError as error:
        raise CaptureError(f"{error.filename}: cannot be read ({error.strerror}).") from error
    if stated.trials is not None or stated.static is not None:
        raise CaptureError(
            f"{by_hand}: names trials or a static trial, but those of a .b3d file are inside it. Leave these "
            "keys out."
        )
    described = stated.or_else(_described(b3d.header, file.name))
    trials = _trials(b3d, file)
    if not trials:
        raise CaptureError(f"{file}: no trial with a frame in it. Download or export it again.")
    has_model = bool(b3d.header.passes) and described.model_is != DEFAULT_BODY
    model = described.model or (file if has_model else None)
    model_is = described.model_is if described.model_is != DEFAULT_BODY else None
    if model == file and model_is in (None, "scaled"):
        model_is = STORED
    subject = Subject(
        folder=folder,
        trials=trials,
        mass_kg=described.counted_kg,
        scale_factor=described.scale_factor,
        height_m=described.height_m,
        sex=described.sex,
        age_years=described.age_years,
        model=model,
        model_is=model_is,
        marker_map=marker_map if has_map else None,
        foot_bodies=described.foot_bodies or Subject.foot_bodies,
        tags=described.tags or (),
        release=described.release,
        notes=(*described.notes, *_left_out(b3d, file.name)),
        recording=file,
    )
    if not folder.is_dir():
        return subject
    used = (path for path in (model, subject.marker_map) if path is not None)
    return replace(subject, unused=unused_files(folder, used, {}, {}))


def _trials(b3d: B3dFile, file: Path) -> tuple[TrialFiles, ...]:
    trials = []
    for found in trials_in(b3d):
        review = review_of(b3d.header, found.segments)
        inner = None if review is None else review.finished
        trials.append(TrialFiles(found.name, file, inner_review_finished=inner))
    return tuple(trials)


def _described(header: Header, name: str) -> Description:
    """The person as the header has them; 0 and words that are none count as unknown."""
    notes: list[Note] = []

    def known(value: float, quantity: str) -> float | None:
        largest, unit = LARGEST[quantity]
        if np.isfinite(value) and 0 < value <= largest:
            return float(value)
        if value:
            text = f"{name}: {quantity} {value:g} {unit} is not possible and counts as unknown"
            notes.append(Note(Kind.OTHER, text))
        return None

    feet = header.ground_contact_body
    return Description(
        mass_kg=known(header.mass_kg, "mass"),
        height_m=known(header.height_m, "height"),
        sex=SEXES.get(header.biological_sex.strip().lower()),
        age_years=known(header.age_years, "age"),
        foot_bodies=tuple(feet) or None,
        tags=tuple(tag for tag in header.subject_tag if tag) or None,
        notes=tuple(notes),
    )


def _left_out(b3d: B3dFile, name: str) -> Iterator[Note]:
    """What else the file holds that no fit uses."""
    header = b3d.header
    kinds = {
        "accelerometers": len(header.acc_name),
        "gyroscopes": len(header.gyro_name),
        "EMG channels": len(header.emg_name),
        "exoskeleton joints": len(header.exo_dof_index),
        "custom series": len(header.custom_value_name),
    }
    held = ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count)
    if held:
        yield Note(Kind.OTHER, f"{name}: also holds {held}, which the fit does not use")
    empty = [trial.name for trial in header.trial_header if not trial.trial_length]
    if empty:
        yield Note(Kind.NOT_READ, f"{name}: trials without a frame are left out: {', '.join(empty)}")
