"""One file to another, chosen by their endings. Nothing is overwritten, nothing lost in silence."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from solver.capture.atomic import drafted, files_together
from solver.capture.formats.text_exports import ENDINGS as TEXT_ENDINGS
from solver.capture.formats.text_table import some_of
from solver.common.errors import CaptureError
from solver.common.file_names import distinct
from solver.export.conversion.content import Content, Part, Trial
from solver.export.conversion.formats import FOLDER, READERS, WRITERS, Writer
from solver.export.conversion.opensim_set import is_opensim_set, read_motion, read_opensim_set
from solver.export.conversion.recordings import read_marker_file
from solver.export.places import file_stem
from solver.skeleton.osim import load_skeleton

TABLES = (".mot", ".sto")
LISTED = 6  # files in a message
MARKER_FILES = (".c3d", ".trc", *TEXT_ENDINGS)
SET_FILES = (".osim", ".mot", ".sto", ".trc")  # what is read of a folder


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
        made = drafted(draft)
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
