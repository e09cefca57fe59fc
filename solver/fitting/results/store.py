"""A subject's results folder.

    results/fit.json                 the figures; and, written last, which folder beside it holds the fit
    results/solve-3/skeleton.json    tree, inertias and markers of the fitted skeleton
    results/solve-3/subject.json     who was fitted, from which files, with which settings; where a re-solve
                                     begins; layouts of held-out forces
    results/solve-3/trials/NAME.npz  one trial's arrays

A solve is written into a hidden folder of its own. It gets its name, and `fit.json` is replaced in one
step, after everything else lies on the disk: a run killed half-way leaves the previous fit whole. Writers
take turns (`results.writing`); who reads meanwhile gets the fit before or after. Only folders named
solve-N are ever removed: whatever else lies there stays.
"""

import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from solver.capture.atomic import draft_folder, move_draft_folder, on_disk, write_whole
from solver.capture.formats.b3d.places import results_folder_of
from solver.common.disk_errors import writing_failed
from solver.common.errors import ResultsError
from solver.common.file_names import distinct
from solver.common.npz import stored_arrays
from solver.common.operating_system import abandoned
from solver.common.small_files import json_content, json_of
from solver.common.typed_json import plain
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.results.codec import Arrays, Decoder, Encoder, Tree
from solver.fitting.results.named import named_in
from solver.fitting.results.writing import writing
from solver.fitting.summary import summary

FORMAT = 4  # of everything below the results folder; raised when an old reader would misread it
_SUBJECT_FIELDS = (
    "subject",
    "mass_kg",
    "height_m",
    "settings",
    "provenance",
    "notes",
    "groundwork",
    "held_out_due",
    "held_out_layouts",
)
Read = TypeVar("Read")
_SHA256 = "sha256"  # in fit.json: of the solve's JSON files, by name
_TREE = "tree"  # the array in a trial's file that says what the others are


def default_folder(subject_folder: Path) -> Path:
    """Where a subject's results go unless somebody says otherwise."""
    return results_folder_of(subject_folder) or subject_folder / "results"


def has_fit(folder: Path) -> bool:
    """Whether a results folder claims to hold a fit."""
    return (folder / "fit.json").is_file()


def check_place(folder: Path) -> None:
    """Refuse, before a solve, a results folder that could not be written after it.

    Raises:
        ResultsError: a file is in the way, or the folder is read-only.
    """
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not there.is_dir():
        raise ResultsError(
            f"{there}: is a file; results need a folder. Move it away, or name another with --out."
        )
    if not os.access(there, os.W_OK | os.X_OK):
        raise ResultsError(f"{there}: cannot be written to. Make it writable, or name another with --out.")


def save_fit(fit: Fit, folder: Path) -> list[Path]:
    """Write a fit in place of the previous one; all of it or nothing.

    Args:
        fit: the solved subject.
        folder: the results folder, made where it's missing.

    Returns:
        The files written, `fit.json` first.
    """
    made = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with draft_folder(folder) as draft:
            names = [path.relative_to(draft) for path in _write_solve(fit, draft)]
            return _put_in_place(fit, draft, names, folder)
    except BaseException as error:
        for parent in made:
            _remove_if_empty(parent)
        if isinstance(error, OSError):
            raise ResultsError(f"{writing_failed(folder, error)} Nothing was changed there.") from error
        raise


def _put_in_place(fit: Fit, draft: Path, names: Sequence[Path], folder: Path) -> list[Path]:
    """Let the solve in a draft be the fit of a results folder."""
    with writing(folder) as alone:
        solve = _next_solve(draft, folder)
        try:
            written = [solve / name for name in names]
            files = ["fit.json", *(path.relative_to(folder).as_posix() for path in written)]
            written_as = {path.name: _sha256(path) for path in written if path.suffix == ".json"}
            head = {
                "format": FORMAT,
                "solve": solve.name,
                _SHA256: written_as,
                **plain(summary(fit, files=files)),
            }
            write_json(folder / "fit.json", head)
        except BaseException:
            shutil.rmtree(solve, ignore_errors=True)
            raise
        _remove_other_solves(folder, solve, alone)
    return [folder / "fit.json", *written]


def _next_solve(draft: Path, folder: Path) -> Path:
    """The draft under its name; where there are no locks, another program may take a number first."""
    number = max(_numbers(folder), default=0) + 1
    while True:
        solve = folder / f"solve-{number}"
        try:
            move_draft_folder(draft, solve)
        except OSError:
            if not solve.exists():
                raise
            number += 1
        else:
            return solve


def load_fit(folder: Path, subject_folder: Path) -> Fit:
    """Read the fit that a results folder holds.

    Args:
        folder: the results folder.
        subject_folder: where the measured files lie now.

    Raises:
        ResultsError: there is no fit, only half of one, or one of another version; or it names a file
            that lies elsewhere.
    """
    return read_whole(folder, lambda head: _read_fit(head, folder, subject_folder))


def read_whole(folder: Path, read: Callable[[Mapping[str, Any]], Read]) -> Read:
    """Read what belongs to the fit of a results folder; again if another fit takes its place meanwhile.

    Args:
        folder: the results folder.
        read: from the content of its `fit.json`.

    Returns:
        What `read` returned, all of it of one fit.

    Raises:
        ResultsError: there is no fit, or `read` found only half of one.
    """
    while True:
        head = _read_json(folder / "fit.json")
        try:
            return read(head)
        except (ResultsError, OSError):
            if _read_json(folder / "fit.json") == head:
                raise


def _read_fit(head: Mapping[str, Any], folder: Path, subject_folder: Path) -> Fit:
    if head.get("format") != FORMAT:
        raise ResultsError(
            f"{folder / 'fit.json'}: written in format {head.get('format')}, this version reads {FORMAT}. "
            "Fit the subject again: addb-viewer fit"
        )
    solve = named_in(folder, head.get("solve"), folder / "fit.json")
    _check_unchanged(solve, head.get(_SHA256))
    about = _read_json(solve / "subject.json")
    members = {
        name: _decoded(solve / "subject.json", Decoder(subject_folder), about.get(name))
        for name in _SUBJECT_FIELDS
    }
    members["settings"] = _with_lists(members["settings"])
    members["held_out_layouts"] = members["held_out_layouts"] or ()  # an older version kept them elsewhere
    skeleton = _decoded(solve / "skeleton.json", Decoder(subject_folder), _read_json(solve / "skeleton.json"))
    files = [named_in(solve, name, solve / "subject.json") for name in about.get("trials", ())]
    trials = tuple(_read_trial(file, subject_folder) for file in files)
    return Fit(skeleton=skeleton, trials=trials, **members)


def _check_unchanged(solve: Path, written_as: object) -> None:
    """Archives of arrays check themselves; a changed byte of JSON may be another value."""
    if not isinstance(written_as, dict):
        return
    for name in ("skeleton.json", "subject.json"):
        if name in written_as and (solve / name).is_file() and _sha256(solve / name) != written_as[name]:
            raise _incomplete(solve / name, ValueError("it is damaged, or was edited"))


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _with_lists(value: Any) -> Any:
    """Settings as `as_dict` gives them, with lists where the decoder makes tuples."""
    if isinstance(value, Mapping):
        return {key: _with_lists(item) for key, item in value.items()}
    return [_with_lists(item) for item in value] if isinstance(value, tuple) else value


def files_of_fit(folder: Path) -> list[Path]:
    """The files of the fit that a results folder holds, `fit.json` first.

    Raises:
        ResultsError: there is no fit.
    """
    file = folder / "fit.json"
    names = _read_json(file).get("files")
    if not isinstance(names, list):
        raise _incomplete(file, TypeError("it names no files"))
    return [named_in(folder, name, file) for name in names]


def write_json(path: Path, content: Mapping[str, object]) -> None:
    """Write strict JSON (no NaN) in one step: the old file or the new one, never half of it."""
    write_whole(path, json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _write_solve(fit: Fit, solve: Path) -> list[Path]:
    encoder = Encoder(fit.subject.folder, inline=True)
    skeleton, subject, trials = solve / "skeleton.json", solve / "subject.json", solve / "trials"
    trials.mkdir()
    stems = distinct([trial.capture.name for trial in fit.trials], _file_name)
    files = [trials / f"{stems[trial.capture.name]}.npz" for trial in fit.trials]
    for trial, path in zip(fit.trials, files, strict=True):
        _write_trial(trial, path, fit.subject.folder)
    write_json(skeleton, encoder.encode(fit.skeleton))
    about: dict[str, Tree] = {name: encoder.encode(getattr(fit, name), name) for name in _SUBJECT_FIELDS}
    write_json(subject, {**about, "trials": [path.relative_to(solve).as_posix() for path in files]})
    return [skeleton, subject, *files]


def _write_trial(trial: TrialFit, path: Path, base: Path) -> None:
    encoder = Encoder(base)
    tree = json.dumps(encoder.encode(trial), allow_nan=False)
    arrays: Arrays = {_TREE: np.array(tree), **encoder.arrays}
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
        on_disk(file)


def _read_trial(path: Path, base: Path) -> TrialFit:
    try:
        arrays = stored_arrays(path)
        tree = json_of(str(arrays.pop(_TREE)))
    except (OSError, ValueError, KeyError) as error:
        raise _incomplete(path, error) from error
    return _decoded(path, Decoder(base, arrays), tree)


def _read_json(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise ResultsError(f"{path}: missing, so there is no whole fit here. Run: addb-viewer fit")
    try:
        content = json_content(path)
    except (ValueError, OSError) as error:
        raise _incomplete(path, error) from error
    if not isinstance(content, dict):
        raise _incomplete(path, TypeError("not an object"))
    return content


def _decoded(path: Path, decoder: Decoder, tree: Tree) -> Any:
    try:
        return decoder.decode(tree)
    except (ResultsError, RecursionError, ValueError) as error:
        raise ResultsError(f"{path}: {error}. Fit the subject again: addb-viewer fit") from error


def _incomplete(path: Path, error: Exception) -> ResultsError:
    return ResultsError(f"{path}: cannot be read ({error}). Fit the subject again: addb-viewer fit")


def _file_name(trial: str) -> str:
    """A trial's name with what file systems dislike written as %xx, byte by byte."""
    return re.sub(r"[^\w .+-]|^\.", lambda match: "".join(f"%{b:02x}" for b in match[0].encode()), trial)


def _numbers(folder: Path) -> list[int]:
    matches = [re.fullmatch(r"solve-(\d+)", path.name) for path in folder.iterdir()]
    return [int(match[1]) for match in matches if match]


def _remove_other_solves(folder: Path, current: Path, alone: bool) -> None:
    """Without locks, another program may be about to name its solve in `fit.json`: a young one stays."""
    for number in _numbers(folder):
        solve = folder / f"solve-{number}"
        if solve != current and (alone or abandoned(solve)):
            shutil.rmtree(solve, ignore_errors=True)


def _remove_if_empty(folder: Path) -> None:
    try:
        folder.rmdir()
    except OSError:
        return
