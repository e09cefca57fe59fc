"""What lies in a subject's folder and is not used, and why: the most harmful loss first."""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from solver.capture.capture import UnusedFile
from solver.capture.formats.b3d.places import SUFFIX
from solver.capture.formats.recording_files import is_force_table, is_recording
from solver.capture.formats.text_exports import ENDINGS as TEXT_ENDINGS
from solver.capture.formats.text_exports import HEAD_BYTES, Program, export_of
from solver.capture.formats.text_table import read_text, some_of
from solver.capture.subject.loose_files import (
    LEADS_OUT,
    files_in,
    holds_force_columns,
    holds_no_points,
    leads_out,
)
from solver.capture.subject.subject_layout import folders_below
from solver.common.errors import CaptureError

FORCES, MARKERS, MODEL, REVIEW, ANGLES, DATA, OTHER = range(7)  # how much is lost: the forces first
OWN = re.compile(
    r"subject\.toml|settings\.toml|markers\.toml|_subject\.json|annotations\.sqlite.*|.*\.lock", re.IGNORECASE
)
AS_C3D = "export the recording as C3D"
KINDS = (  # what files of these endings are, and what to do with them
    (
        ".xlsx .xls .ods",
        "a spreadsheet",
        f"{AS_C3D}, or save the program's own CSV again without changing it",
    ),
    (
        ".qtm",
        "a recording of Qualisys Track Manager",
        "export it there as C3D, or as TSV with 3D and force data",
    ),
    (".tak", "a take of OptiTrack Motive", "export it there as C3D, or as CSV with labelled markers"),
    (
        ".x1d .x2d .xcp .system .history",
        "raw data of Vicon Nexus",
        "reconstruct and label the trial there, then export C3D",
    ),
    (
        ".enf .vsk .vst .mp .mkr .prj",
        "a description of Vicon's or Cortex' programs, without a motion",
        "nothing is needed of it",
    ),
    (".cap .trb .vc .vc1 .vc2 .vc3", "a binary recording of Cortex", f"{AS_C3D} or TRC there"),
    (
        ".anb .anc .cal",
        "analog channels of Cortex",
        "export the forces in a C3D, beside or instead of the TRC",
    ),
    (".tdf .emt .mdx .mdr", "a recording of BTS", "export C3D there"),
    (".cmz .v3d", "a workspace of Visual3D", "save its recordings as C3D"),
    (".bvh .fbx .amc .asf", "a motion of bones, without markers", f"{AS_C3D} where it was made"),
    (
        ".mat .npy .npz .h5 .hdf5 .parquet .pkl",
        "arrays of a kind that is not read here",
        f"{AS_C3D}, or write TRC and MOT from them",
    ),
    (".zip .7z .gz .tar .rar", "an archive", "unpack it"),
    (".avi .mp4 .mov .mkv .wmv", "a video", "markers are needed: nothing is measured in it"),
    (
        ".csv .tsv .txt .emg .drf",
        "text of a kind that is not read here",
        f"{AS_C3D}, TRC, or the text of QTM, Nexus or Motive",
    ),
)
BY_ENDING = {ending: (what, remedy) for endings, what, remedy in KINDS for ending in endings.split()}
DFLOW = re.compile(r"%?\s*TimeStamp\b.*\.(PosX|ForX|MomX|CopX)", re.IGNORECASE)
WITHOUT_POINTS = "a C3D file of analog channels without markers: not a trial", "export its forces as MOT"
IN_SHORT = 3  # names of a kind in a message


def unused_files(
    folder: Path, used: Iterable[Path], left: Mapping[Path, str], others: Mapping[Path, str], silent: str = ""
) -> tuple[UnusedFile, ...]:
    """Every file of a subject's folder that a fit of it would not read.

    Hidden files, results, bone meshes, and the program's own files beside the recordings are no recordings.

    Args:
        folder: of the subject.
        used: files that are read.
        left: why files are not.
        others: folders with marker files that are not this subject's, and why.
        silent: why a recording is not used that neither of these knows.
    """
    known = set(used)
    found = []
    for place in (folder, *folders_below(folder)):
        owner = next((other for other in others if place == other), None)
        if owner is not None:
            recordings = sum(map(is_recording, files_in(place)))
            name = f"{place.relative_to(folder).as_posix()}/"
            found.append(UnusedFile(name, f"{recordings} marker files: {others[owner]}", MARKERS))
        if any(place.is_relative_to(other) for other in others):
            continue
        for path in files_in(place):
            if path not in known and not OWN.fullmatch(path.name):
                link = LEADS_OUT if leads_out(path, folder) else None
                harm, reason = _judged(path, left.get(path, link), silent)
                found.append(UnusedFile(path.relative_to(folder).as_posix(), reason, harm))
    return tuple(sorted(found, key=lambda file: file.harm))


def read_with(reviews: Iterable[Path]) -> Iterator[Path]:
    """Files that are read beside the review.json of segments."""
    for review in reviews:
        yield review
        yield review.with_name("data.csv")


def _judged(path: Path, reason: str | None, silent: str) -> tuple[int, str]:
    """How much is lost without a file, and why it is not used."""
    kind = path.suffix.lower()
    if is_force_table(path):
        if reason is not None:
            return FORCES, reason
        if not holds_force_columns(path):
            return ANGLES, "no columns of ground forces: joint angles or other results"
        return FORCES, f"forces; {silent or 'in a folder that is not searched for forces'}"
    if reason is None and holds_no_points(path):
        return FORCES, "; ".join(WITHOUT_POINTS)
    if is_recording(path):
        return MARKERS, reason or f"markers; {silent or 'no trial of this subject'}"
    if kind == ".osim":
        return MODEL, reason or f"a model; {silent or 'another is used, or none beside the recordings'}"
    if path.name.lower() == "review.json":
        return (REVIEW, reason or f"a review of frames; {silent or 'it lies beside no single trial'}")
    if kind == SUFFIX:
        return DATA, "a subject of its own: give this file by its name"
    if kind in BY_ENDING:
        return DATA, "; ".join(_kind_of(path))
    return OTHER, "no recording"


def _kind_of(path: Path) -> tuple[str, str]:
    """What a file of a kind that is not read is, and what to do: by its ending, and text by its head."""
    what, remedy = BY_ENDING[path.suffix.lower()]
    if path.suffix.lower() not in TEXT_ENDINGS or path.is_symlink():
        return what, remedy
    export = export_of(path)
    if export is not None:
        held = f" ({export.kind})" if export.kind else ""
        wanted = {
            Program.QTM: "3D data with the head",
            Program.NEXUS: "Trajectories",
            Program.MOTIVE: "positions of labelled markers",
        }[export.program]
        return f"text of {export.program.value}{held}, without markers or forces", f"export {wanted} with it"
    try:
        head = read_text(path, HEAD_BYTES).lines[:3]
    except CaptureError:
        return what, remedy
    if any(DFLOW.match(line) for line in head):
        return "text of D-Flow (Motek)", "export the session's C3D of the capture program"
    return what, remedy


def what_lies_in(folder: Path) -> str:
    """A sentence on each kind of data in a folder without trials: its files, what it is, what to do."""
    kinds: dict[tuple[str, str], list[str]] = {}
    for place in (folder, *folders_below(folder)):
        for path in files_in(place):
            if holds_no_points(path):
                kind = WITHOUT_POINTS
            elif is_recording(path):
                continue
            elif path.suffix.lower() in BY_ENDING and not is_force_table(path):
                kind = _kind_of(path)
            elif is_force_table(path):
                kind = "forces or angles, without markers", "put the markers' file beside it"
            else:
                continue
            kinds.setdefault(kind, []).append(path.relative_to(folder).as_posix())
    return "".join(
        f" {some_of(names, IN_SHORT)}: {what}; {remedy}." for (what, remedy), names in kinds.items()
    )
