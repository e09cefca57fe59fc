"""One file to another, chosen by their endings. Nothing is overwritten, nothing lost in silence."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from solver.capture.atomic import files_of_draft, files_together
from solver.capture.formats.text_exports import ENDINGS as TEXT_ENDINGS
from solver.capture.formats.text_table import some_of
from solver.common.errors import CaptureError
from solver.common.file_names import distinct
from solver.export.conversion.b3d_content import read_b3d_file, write_b3d_file
from solver.export.conversion.file_content import Content, Part, Trial
from solver.export.conversion.opensim_set import (
    is_opensim_set,
    read_motion,
    read_opensim_set,
    write_opensim_set,
)
from solver.export.conversion.parquet import read_parquet, write_parquet
from solver.export.conversion.recordings import (
    read_force_table,
    read_marker_file,
    read_text_export,
    write_c3d_file,
    write_mot,
    write_trc_file,
)
from solver.export.export_places import file_stem
from solver.export.gltf import moving_skeleton
from solver.export.mjcf import write_mujoco
from solver.skeleton.bones import body_meshes
from solver.skeleton.osim import load_skeleton

TABLES = (".mot", ".sto")
LISTED = 6  # files in a message
MARKER_FILES = (".c3d", ".trc", *TEXT_ENDINGS)
SET_FILES = (".osim", ".mot", ".sto", ".trc")  # what is read of a folder
FOLDER = ""  # the ending of a folder for OpenSim
MEASURED = frozenset({Part.MARKERS, Part.PLATES})
MOVING = frozenset({Part.MODEL, Part.MOTION})
READERS: dict[str, Callable[[Path], Content]] = {
    ".c3d": read_marker_file,
    ".trc": read_marker_file,
    ".mot": read_force_table,
    ".sto": read_force_table,
    ".forces": read_force_table,
    **dict.fromkeys(TEXT_ENDINGS, read_text_export),
    ".b3d": read_b3d_file,
    ".parquet": read_parquet,
}


@dataclass(frozen=True)
class Writer:
    """How a format is written: what it needs must be there; what it cannot hold is told."""

    write: Callable[[Content, Path], tuple[str, ...]]  # returns notes
    holds: frozenset[Part]
    needs: frozenset[Part]
    holds_all_trials: bool = False  # else a file is written for each


def write_glb(content: Content, path: Path) -> tuple[str, ...]:
    """Write one trial's moving skeleton as glTF, with the stock bones."""
    (trial,) = content.trials
    assert content.skeleton is not None
    assert trial.motion is not None
    meshes = body_meshes(content.skeleton).meshes
    path.write_bytes(moving_skeleton(content.skeleton, meshes, trial.motion, trial.name))
    return ()


def write_mjcf(content: Content, path: Path) -> tuple[str, ...]:
    """Write the model for MuJoCo, its bones, and a motion file for each trial."""
    assert content.skeleton is not None
    motions = {trial.name: trial.motion for trial in content.trials if trial.motion is not None}
    meshes = body_meshes(content.skeleton).meshes
    return write_mujoco(path, content.skeleton, meshes, motions)[1]


WRITERS = {
    ".c3d": Writer(
        write_c3d_file,
        holds=MEASURED | {Part.ANALOG, Part.EVENTS, Part.MOTION, Part.TORQUES, Part.PERSON},
        needs=frozenset({Part.MARKERS}),
    ),
    ".trc": Writer(write_trc_file, holds=MEASURED, needs=frozenset({Part.MARKERS})),
    ".mot": Writer(write_mot, holds=frozenset({Part.PLATES}), needs=frozenset({Part.PLATES})),
    ".sto": Writer(write_mot, holds=frozenset({Part.PLATES}), needs=frozenset({Part.PLATES})),
    ".parquet": Writer(
        write_parquet, holds=MEASURED | {Part.ANALOG, Part.MOTION, Part.TORQUES}, needs=frozenset()
    ),
    ".b3d": Writer(
        write_b3d_file,
        holds=frozenset(Part) - {Part.ANALOG, Part.EVENTS},
        needs=frozenset(),
        holds_all_trials=True,
    ),
    ".glb": Writer(write_glb, holds=MOVING, needs=MOVING),
    ".xml": Writer(write_mjcf, holds=MOVING, needs=MOVING, holds_all_trials=True),
    FOLDER: Writer(
        write_opensim_set,
        holds=frozenset(Part) - {Part.ANALOG, Part.EVENTS},
        needs=MOVING,
        holds_all_trials=True,
    ),
}


@dataclass(frozen=True)
class Converted:
    """What was written, and what a person should know of it."""

    files: tuple[Path, ...]
    notes: tuple[str, ...]


def convert(
    source: Path,
    target: Path,
    *,
    forces: Path | None = None,
    model: Path | None = None,
    trials: Collection[str] = (),
    overwrite: bool = False,
) -> Converted:
    """Write what a file holds in another format.

    Args:
        source: a file that `READERS` knows, or a folder for OpenSim.
        target: a file with an ending of `WRITERS`, or a folder for OpenSim.
        forces: a table of ground forces that belongs to markers in `source`.
        model: an OpenSim model whose motion `source`, a .mot or .sto file, is.
        trials: of several, only these; all where none is named.
        overwrite: replace files that are there.

    Raises:
        SolverError: a file cannot be read or written, or the target has no place for what there is.
    """
    writer = _writer(target)
    content = _chosen(_read(source, forces, model), trials)
    missing = writer.needs - content.parts()
    if missing:
        raise CaptureError(
            f"{target}: cannot be made of {source.name}, which holds no {_listed(missing)}. "
            + _instead(missing, source, target)
        )
    read = _files_of(source, forces, model)
    files, notes = _written(content, target, writer, read, overwrite)
    return Converted(files, (*content.notes, *notes, *_losses(content, writer, target)))


def _writer(target: Path) -> Writer:
    ending = target.suffix.lower()
    if ending not in WRITERS:
        known = ", ".join(each for each in WRITERS if each)
        raise CaptureError(
            f"{target}: files of that ending are not written. Choose one of {known}, or a folder."
        )
    return WRITERS[ending]


def _read(source: Path, forces: Path | None, model: Path | None) -> Content:
    ending = source.suffix.lower()
    if forces is not None and ending not in MARKER_FILES:
        raise CaptureError(f"{source}: forces of another file belong to a file of markers.")
    if model is not None and ending not in TABLES:
        raise CaptureError(
            f"{source}: a model is given to a .mot or .sto file of coordinates, which lacks one."
        )
    if source.is_dir():
        if not is_opensim_set(source):
            raise CaptureError(
                f"{source}: no model with a motion (MODEL.osim, TRIAL_ik.mot) lies in it. A subject's "
                "recordings are fitted, and written by `addb-viewer export`."
            )
        return read_opensim_set(source)
    if not source.exists():
        raise CaptureError(f"{source}: no file of that name. Check the spelling of the path.")
    if ending not in READERS:
        raise CaptureError(
            f"{source}: files of that ending are not read. Give one of {', '.join(READERS)}, or a folder "
            "with a model and its motions."
        )
    if model is not None:
        skeleton = load_skeleton(model)
        motion, notes = read_motion(source, skeleton)
        return Content(
            source, (Trial(source.stem, motion=motion),), skeleton, mass_kg=skeleton.mass, notes=notes
        )
    if forces is not None:
        return read_marker_file(source, forces)
    return READERS[ending](source)


def _chosen(content: Content, names: Collection[str]) -> Content:
    known = [trial.name for trial in content.trials]
    unknown = [name for name in names if name not in known]
    if unknown:
        raise CaptureError(
            f"{content.source}: no trial '{unknown[0]}'; trials: {', '.join(known)}. Check the spelling."
        )
    return content.of([trial for trial in content.trials if not names or trial.name in names])


def _files_of(source: Path, forces: Path | None, model: Path | None) -> tuple[Path, ...]:
    """The files that were read, none of which is replaced."""
    of_set = source.iterdir() if source.is_dir() else ()
    inside = [path for path in of_set if path.suffix.lower() in SET_FILES]
    return (source, *inside, *(path for path in (forces, model) if path is not None))


def _written(
    content: Content, target: Path, writer: Writer, read: Collection[Path], overwrite: bool
) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    is_folder = target.suffix == FOLDER
    home, notes = target if is_folder else target.parent, list[str]()
    with files_together(
        home, lambda places: _refuse_to_replace(places, read, overwrite), overwrite=overwrite
    ) as draft:
        if writer.holds_all_trials:
            notes += writer.write(content, draft if is_folder else draft / target.name)
        else:
            for trial, name in _names(content, target):
                notes += writer.write(content.of([trial]), draft / name)
        made = files_of_draft(draft)
    return tuple(home / path for path in made), tuple(notes)


def _names(content: Content, target: Path) -> list[tuple[Trial, str]]:
    """Each trial's file: the target's name, with the trial's in it where there are several."""
    if len(content.trials) == 1:
        return [(content.trials[0], target.name)]
    stems = distinct([trial.name for trial in content.trials], file_stem)
    return [(trial, f"{target.stem}_{stems[trial.name]}{target.suffix}") for trial in content.trials]


def _refuse_to_replace(paths: Sequence[Path], read: Collection[Path], overwrite: bool) -> None:
    sources = {path.resolve() for path in read}
    own = [path for path in paths if path.resolve() in sources]
    if own:
        raise CaptureError(f"{own[0]}: is what was to be converted, and stays as it is. Name another file.")
    folders = [path for path in paths if path.is_dir()]
    if folders:
        raise CaptureError(f"{folders[0]}: is a folder. Name a file, or move the folder away.")
    there = [path.name for path in paths if path.exists()]
    if there and not overwrite:
        raise CaptureError(
            f"{paths[0].parent}: {some_of(there, LISTED)} would be replaced. Name another target, "
            "or say --overwrite."
        )


def _losses(content: Content, writer: Writer, target: Path) -> tuple[str, ...]:
    """What was read and has no place in the target, and what was not even read."""
    lost = content.parts() - writer.holds
    said = []
    if lost:
        said.append(f"{target.name or target}: has no place for {_listed(lost)} of {content.source.name}")
    if content.left_behind:
        said.append(f"{content.source.name}: not converted: {'; '.join(content.left_behind)}")
    return tuple(said)


def _listed(parts: Iterable[Part]) -> str:
    return ", ".join(part for part in Part if part in set(parts))


def _instead(missing: Collection[Part], source: Path, target: Path) -> str:
    """What a person can do about it."""
    if Part.MODEL in missing or Part.MOTION in missing:
        if source.suffix.lower() in TABLES:
            return "Name the model of these coordinates with --model."
        return "Fit it first: `addb-viewer fit`, then `addb-viewer export`."
    if Part.MARKERS in missing:
        return f"Convert a recording with markers, or choose another ending than {target.suffix}."
    return "Choose another ending."
