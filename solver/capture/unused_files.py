"""What lies in a subject's folder and is not used, and why: the most harmful loss first."""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from solver.capture.b3d.places import SUFFIX
from solver.capture.capture import UnusedFile
from solver.capture.loose_files import (
    LEADS_OUT,
    TABLES,
    files_in,
    holds_force_columns,
    holds_no_points,
    is_recording,
    leads_out,
)
from solver.capture.subject_layout import folders_below

FORCES, MARKERS, MODEL, REVIEW, ANGLES, DATA, OTHER = range(7)  # how much is lost: the forces first
OWN = re.compile(
    r"subject\.toml|settings\.toml|markers\.toml|_subject\.json|annotations\.sqlite.*|.*\.lock", re.IGNORECASE
)
DATA_KINDS = {
    **dict.fromkeys((".csv", ".xlsx", ".xls", ".ods", ".mat", ".h5", ".hdf5", ".npz", ".parquet"), "a table"),
    **dict.fromkeys(
        (".asf", ".amc", ".bvh", ".fbx", ".qtm", ".tsv", ".v3d", ".cmz", ".tak", ".vsk", ".vst"), "motion"
    ),
    **dict.fromkeys((".anc", ".forces", ".tdf", ".emg", ".xcp", ".x2d", ".x1d", ".drf"), "a recording"),
}


def unused_files(
    folder: Path,
    used: Iterable[Path],
    left: Mapping[Path, str],
    others: Mapping[Path, str],
    silent: str = "",
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
        stranger = next((other for other in others if place == other), None)
        if stranger is not None:
            recordings = sum(map(is_recording, files_in(place)))
            name = f"{place.relative_to(folder).as_posix()}/"
            found.append(UnusedFile(name, f"{recordings} marker files: {others[stranger]}", MARKERS))
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
    if kind in TABLES:
        if reason is not None:
            return FORCES, reason
        if not holds_force_columns(path):
            return ANGLES, "no columns of ground forces: joint angles or other results"
        return FORCES, f"forces; {silent or 'in a folder that is not searched for forces'}"
    if reason is None and holds_no_points(path):
        return FORCES, "a C3D file of analog channels without markers: not a trial. Export its forces as MOT"
    if is_recording(path):
        return MARKERS, reason or f"markers; {silent or 'no trial of this subject'}"
    if kind == ".osim":
        return MODEL, reason or f"a model; {silent or 'another is used, or none beside the recordings'}"
    if path.name.lower() == "review.json":
        return (
            REVIEW,
            reason or f"a review of frames; {silent or 'it lies beside no single trial'}",
        )
    if kind == SUFFIX:
        return DATA, "a subject of its own: give this file by its name"
    if kind in DATA_KINDS:
        return DATA, f"{DATA_KINDS[kind]} of a kind that is not read here; C3D, TRC, MOT and STO are"
    return OTHER, "no recording"
