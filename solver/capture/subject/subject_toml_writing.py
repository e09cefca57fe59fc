"""A subject.toml that says what was understood of a folder, with reasons as comments, to be corrected."""

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path

from solver.capture.capture import Subject, TrialFiles
from solver.common.file_names import readable

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_HEAD = """\
# How addb-viewer understood this folder. Correct what is wrong: from now on this file is used, and files
# that it does not name are not. Paths are relative to this folder.
# All keys: docs/reference/inputs.md.
"""

_HEAD_OF_B3D = """\
# What the .b3d file says about the person. Correct what is wrong: values here replace those of the file.
# Its trials are those inside it. All keys: docs/reference/inputs.md.
"""

_ABOUT_PLATES = (
    "",
    "# The sign and the zero level of each plate are found from the recording. To set them yourself:",
    '# [trials.NAME.plates."PLATE"]  # named as in the notes',
    '# reads = "person"  # the force on the person; "plate": the force on the plate, its sign is changed',
    "# zero_N = 0.0  # its vertical force with nobody on it, with the sign as in the file",
)


_ABOUT_RELEASE = (
    "",
    "# For releases (addb-viewer dataset build):",
    "# [release]",
    '# source = "SOURCE"  # publication or collection; person = "P01", laboratory = "…"',
    '# licence = "CC-BY-4.0"  # SPDX identifier or URL',
    '# consent = "public"  # or "restricted", "unknown"',
    '# citation = "cite.bib"  # or a text; doi = "10.1234/abcd", url = "https://…"',
)


def described_as_toml(subject: Subject) -> str:
    """The text of a subject.toml that `open_subject` reads as this subject."""
    if subject.recording is not None:
        about = [_HEAD_OF_B3D, *_person(subject), *_model(subject)]
    else:
        about = [_HEAD, *_person(subject), *_files(subject), *_trials(subject)]
    return "\n".join([*about, *_release(subject), *_comments(subject)]) + "\n"


def _person(subject: Subject) -> Iterator[str]:
    for key, value, without in (
        ("mass_kg", subject.mass_kg, "70.0  # unknown: estimated from the forces, else the height"),
        ("height_m", subject.height_m, "1.75  # unknown: estimated from the scaled model"),
        ("sex", subject.sex, '"female"'),
        ("age_years", subject.age_years, None),
    ):
        if value is not None:
            yield f"{key} = {json.dumps(value)}"
        elif without is not None:
            yield f"# {key} = {without}"
    yield f"foot_bodies = {json.dumps(list(subject.foot_bodies))}"
    if subject.prefix is not None:
        yield f"prefix = {_text(subject.prefix)}  # before this person's labels: PREFIX:LASI"
    if subject.tags:
        yield f"tags = {_text(list(subject.tags))}"


def _files(subject: Subject) -> Iterator[str]:
    if subject.model is not None:
        yield f"model = {_path(subject, subject.model)}"
    else:
        yield '# model = "scaled.osim"  # without it: the default full body'
    if subject.static is not None:
        yield f"static = {_path(subject, subject.static)}"
    else:
        yield '# static = "static.trc"  # without it: scaled with the trials'


def _model(subject: Subject) -> Iterator[str]:
    yield '# "scaled": the model in the file as it is; "generic": scaled again; "default": the built-in body'
    word = {"stored": "scaled", None: "default"}.get(subject.model_is, subject.model_is)
    yield f"model_is = {_text(word)}"


def _trials(subject: Subject) -> Iterator[str]:
    for trial in subject.trials:
        yield ""
        yield f"[trials.{_key(trial.name)}]"
        yield f"markers = {_path(subject, trial.markers)}"
        yield from _forces(subject, trial)
        if trial.reviews:
            yield f"review = [{', '.join(_path(subject, review) for review in trial.reviews)}]"
        for key in ("up", "moments"):
            if getattr(trial, key) is not None:
                yield f"{key} = {_text(getattr(trial, key))}"
        for plate in trial.plates:
            yield f"[trials.{_key(trial.name)}.plates.{_key(plate.name)}]"
            if plate.sign is not None:
                yield f'reads = "{"person" if plate.sign > 0 else "plate"}"'
            if plate.zero_N is not None:
                yield f"zero_N = {plate.zero_N}"
    yield from _ABOUT_PLATES


def _release(subject: Subject) -> Iterator[str]:
    if subject.release is None:
        yield from _ABOUT_RELEASE
        return
    yield "\n[release]"
    for key, value in vars(subject.release).items():
        if value is not None:
            yield f"{key} = {_text(value)}"


def _key(name: str) -> str:
    return name if _BARE_KEY.fullmatch(name) else _text(name)


def _forces(subject: Subject, trial: TrialFiles) -> Iterator[str]:
    if trial.forces is not None:
        yield f"forces = {_path(subject, trial.forces)}"
    elif trial.markers.suffix.lower() == ".c3d":
        yield "# forces: those in the C3D file, if it has any"
    else:
        yield '# forces = "forces.mot"  # none was found'


def _comments(subject: Subject) -> Iterator[str]:
    if subject.notes:
        yield "\n# Notes"
        yield from (f"# - {_line(note)}" for note in subject.notes)
    if subject.unused:
        yield "\n# Not used"
        yield from (f"# - {_line(file.file)}: {_line(file.reason)}" for file in subject.unused)


def _path(subject: Subject, path: Path) -> str:
    return _text(readable(Path(os.path.relpath(path, subject.folder)).as_posix()))


def _text(value: object) -> str:
    """A string or a list of strings; JSON's are TOML's."""
    return json.dumps(value, ensure_ascii=False)


def _line(text: str) -> str:
    """A comment ends with its line, and holds no other control character."""
    return re.sub(r"[\x00-\x1f\x7f]+", " ", text)
