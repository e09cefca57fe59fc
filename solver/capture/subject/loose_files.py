"""Marker files and force tables in folders: which are trials, which belong together, which are left.

A folder of AddBiomechanics' server says it in `_subject.json`; of loose files it is found out.
"""

import hashlib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from solver.capture.capture import TrialFiles
from solver.capture.formats.c3d_contents import BLOCK as HEADER_BYTES
from solver.capture.formats.c3d_contents import SIGNATURE, parameters_in
from solver.capture.formats.qtm_tsv import force_files, plates_beside
from solver.capture.formats.recording_files import CORTEX_ENDING, TABLES, is_force_table, is_recording
from solver.capture.formats.storage import read_columns
from solver.capture.formats.text_exports import ENDINGS as TEXT_ENDINGS
from solver.capture.plates.force_columns import find_plates
from solver.capture.subject.description import Description, read_json
from solver.capture.subject.force_pairing import holds_forces, pair_forces, rawness
from solver.capture.subject.review import RANGES_KEY, trial_ranges
from solver.capture.subject.same_motion import (
    counterparts_among,
    how_they_differ,
    is_part_of,
    is_static,
    moves,
    static_among,
)
from solver.capture.subject.trial_names import Relation, name_tokens, relation
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.small_files import kept_while_unchanged

FORCE_ENDINGS = ("_grf", "_forces", "")
LEADS_OUT = "a link that leads out of the folder: copy the file into it, or name it in subject.toml"
COPY = re.compile(r"( ?\(\d+\)| - \w+( \(\d+\))?)+$")  # X (2), X(1), X - Copy, X - Kopie (2)
AUGMENTED = "_LSTM"  # Pose2Sim's name for a TRC file to which it added computed markers
STANDING = "forces of the static trial, of which only the markers are used"
USED_KEYS = ("massKg", "heightM", "sex", "ageYears", "footBodyNames", "subjectTags", RANGES_KEY)
PROCESSING_KEYS = (  # settings of AddBiomechanics' own server, which mean nothing here
    *("email", "skeletonPreset", "exportSDF", "exportMJCF", "exportMoco", "runMoco", "ignoreJointLimits"),
    *("residualsToZero", "useReactionWheels", "tuneResidualLoss", "shiftGRF", "maxTrialsToSolveMassOver"),
    *("regularizeJointAcc", "dynamicsMarkerOffsets", "dynamicsMarkerWeight", "dynamicsJointWeight"),
    *("dynamicsRegularizePoses", "ignoreFootNotOverForcePlate", "fitDynamics", "disableDynamics"),
    *("segmentTrials", "segmentedTrials", "mergeZeroForceSegmentsThreshold"),
)


@dataclass(frozen=True)
class FoundTrials:
    """What lies in the folders of a subject."""

    trials: tuple[TrialFiles, ...]
    static: Path | None
    notes: tuple[Note, ...]
    left: Mapping[Path, str]  # marker files and tables that are not used, and why
    other_statics: tuple[Path, ...] = ()


def files_in(folder: Path) -> list[Path]:
    """The folder's files in natural order, without hidden ones."""
    files = (p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    return sorted(files, key=lambda p: natural_order(p.name))


def natural_order(name: str) -> tuple[tuple[int, str], ...]:
    """A key that sorts trial2 before trial10."""
    pieces = re.findall(r"\d+|\D+", name.lower())
    return tuple((int(piece), "") if piece.isdigit() else (-1, piece) for piece in pieces)


def leads_out(path: Path, folder: Path) -> bool:
    """Whether a file is a link to somewhere else; such a one is never looked into."""
    return path.is_symlink() and not path.resolve().is_relative_to(folder.resolve())


def holds_no_points(path: Path) -> bool:
    """Whether a C3D file has analog channels alone, forces say: no trial. Damaged ones are not."""
    if path.suffix.lower() != ".c3d":
        return False
    with path.open("rb") as file:
        head = file.read(HEADER_BYTES)
    is_whole = len(head) == HEADER_BYTES and head[1] == SIGNATURE
    pointless = is_whole and head[2:4] == b"\0\0"  # the number of points, in either order of bytes
    return pointless and parameters_in(path, ("ROTATION",)).get("ROTATION:USED", ("0",)) == ("0",)


def trials_among(folder: Path, places: Sequence[Path]) -> FoundTrials:
    """Trials and static trial among the files of a subject's folders.

    Args:
        folder: of the subject.
        places: it, and those below it that are the subject's.
    """
    everything = [path for place in places for path in files_in(place)]
    inside = {path for path in everything if not leads_out(path, folder)}
    copies = copies_among([path for path in everything if path in inside])
    files = [path for path in everything if path not in copies]
    recordings = [p for p in files if is_recording(p) and not (p in inside and holds_no_points(p))]
    versions = _versions_among(folder, [p for p in recordings if p in inside])
    recordings = [p for p in recordings if p not in versions]
    statics = static_among(recordings, inside, folder)
    standing = [p for p in (statics.static, *statics.others) if p is not None]
    moving = [p for p in recordings if p not in standing]
    claimed, notes = _by_exact_name(moving, files)
    counterparts, counterpart_notes = _counterparts(moving, inside)
    notes += (*counterpart_notes, *statics.notes)
    for version, of in versions.items():
        notes += noted(Kind.LEFT_OUT, f"{version.name}: left out, the trial is read from {of.name}")
    tables = [p for p in files if p in inside and is_force_table(p) and holds_force_columns(p)]
    tables = [p for p in tables if p == force_files(p)[0]]
    forces = dict(claimed)
    left: dict[Path, str] = {}
    for written_with_text in (True, False):  # a text export's markers and forces first: one clock, one room
        paired = pair_forces(
            folder,
            [
                p
                for p in moving
                if p in inside
                and p not in forces
                and (_is_text(p) if written_with_text else p not in counterparts.values())
            ],
            [p for p in tables if p not in forces.values() and (_is_text(p) or not written_with_text)],
        )
        forces |= paired.forces
        notes += paired.notes
        left |= paired.left
    left |= {plates: STANDING for still in standing if (plates := plates_beside(still)) is not None}
    left = {
        each: why
        for table, why in left.items()
        if table not in forces.values()
        for each in force_files(table)
    }
    left |= {version: f"the same motion as {of.name}, which is read" for version, of in versions.items()}
    left |= {copy: f"a copy of {of.name}, byte for byte" for copy, of in copies.items()}
    kept: list[tuple[Path, Path | None]] = []
    instead = _read_instead(counterparts, forces)
    for markers in moving:
        if markers in instead:
            better = instead[markers]
            table = forces.get(better)
            left[markers] = f"the same motion as {better.name}, which is read" + (
                f" with {table.name}" if table is not None else ""
            )
            if markers in forces:
                left[forces[markers]] = f"forces of {markers.name}, in place of which {better.name} is read"
            notes += noted(Kind.LEFT_OUT, f"{markers.name}: left out, the trial is read from {better.name}")
        elif markers in forces and markers in inside and holds_forces(markers):
            reason = f"{markers.name} holds its own forces; a subject.toml can name others"
            left[forces[markers]] = reason
            notes += noted(Kind.OTHER, f"{forces[markers].name}: left out, {reason}")
            kept.append((markers, None))
        else:
            kept.append((markers, forces.get(markers)))
    if statics.static is not None:
        left |= dict.fromkeys(statics.others, f"another static trial; {statics.static.name} is used")
    trials = tuple(
        TrialFiles(name, markers, table, _reviews(markers.parent, kept))
        for name, (markers, table) in zip(_names(folder, [m for m, _ in kept]), kept, strict=True)
    )
    return FoundTrials(trials, statics.static, notes, left, statics.others)


def copies_among(files: Sequence[Path]) -> dict[Path, Path]:
    """Recordings and tables that are, byte for byte, others whose names differ by a copy's mark only."""
    by_size: dict[tuple[str, int], list[Path]] = {}
    for path in sorted(files, key=lambda p: (len(p.name), files.index(p))):
        if is_recording(path) or is_force_table(path):
            by_size.setdefault((COPY.sub("", path.stem), path.stat().st_size), []).append(path)
    found: dict[Path, Path] = {}
    for alike in by_size.values():
        first_of: dict[bytes, Path] = {}
        for path in alike if len(alike) > 1 else ():
            with path.open("rb") as file:
                first = first_of.setdefault(hashlib.file_digest(file, "sha256").digest(), path)
            if first != path and first.suffix == path.suffix:
                found[path] = first
    return found


def _versions_among(folder: Path, recordings: Sequence[Path]) -> dict[Path, Path]:
    """TRC files of one motion that were processed further, by their names, and the one that is read.

    The one with augmented markers, which hold the keypoints as well, else the least filtered.
    """

    def rank(path: Path) -> tuple[bool, int]:
        return AUGMENTED not in path.stem, rawness(path)

    found: dict[Path, Path] = {}
    tables = sorted((p for p in recordings if p.suffix.lower() == ".trc"), key=rank)
    for k, read in enumerate(tables):
        for table in tables[k + 1 :] if read not in found else ():
            named = relation(read.relative_to(folder), table.relative_to(folder))
            of_one = rank(read) < rank(table) and named in (Relation.SAME, Relation.PART)
            if table not in found and of_one and not how_they_differ(table, read):
                found[table] = read
    return found


def _read_instead(counterparts: Mapping[Path, Path], forces: Mapping[Path, Path]) -> dict[Path, Path]:
    """Of files of one motion, which is read in place of the others: the one with forces, or most in it.

    A recording with forces of its own is read rather than a part that was cut from it.
    """
    alike: dict[Path, list[Path]] = {}
    for table, recording in counterparts.items():
        alike.setdefault(recording, []).append(table)
    instead: dict[Path, Path] = {}
    for recording, tables in alike.items():
        asked = [p for p in tables if p in forces and (_is_text(p) or is_part_of(p, recording))]
        lesser = asked if asked and holds_forces(recording) else ()
        best = next((p for p in tables if p in forces and p not in lesser), recording)
        instead |= {other: best for other in (recording, *tables) if other != best}
    return instead


def _is_text(path: Path) -> bool:
    return path.suffix.lower() in TEXT_ENDINGS


def find_models(folder: Path) -> list[Path]:
    """unscaled_generic.osim, else each *_scaled.osim, else each .osim; of several nothing says which.

    Without any in the folder itself, those of its `Models`, where AddBiomechanics' results have theirs.
    """
    below = (p for p in folder.iterdir() if p.is_dir() and p.name.lower() == "models")
    places = ([p for p in files_in(place) if p.suffix.lower() == ".osim"] for place in (folder, *below))
    models = next(filter(None, places), [])
    for belongs in (
        [p for p in models if p.name.lower() == "unscaled_generic.osim"],
        [p for p in models if p.stem.lower().endswith("_scaled")],
    ):
        if belongs:
            return belongs
    return models


def reviews_in(place: Path) -> tuple[Path, ...]:
    """review.json of the segments of the one trial that lies in a folder, in order."""
    segments = [p for p in place.glob("segment_*") if re.fullmatch(r"segment_\d+", p.name)]
    reviews = [p / "review.json" for p in sorted(segments, key=lambda p: natural_order(p.name))]
    return tuple(review for review in reviews if review.is_file())


def _by_exact_name(
    recordings: Iterable[Path], files: Sequence[Path]
) -> tuple[dict[Path, Path], tuple[Note, ...]]:
    """X_grf.mot, X_forces.mot, or X.mot where it holds forces, beside X.trc; and notes on what holds none.

    Beside X.tsv it is X_f_1.tsv, which stands for all of X_f_*.tsv; X.forces is Cortex'.
    """
    beside = {(p.parent, p.name.lower()): p for p in files}
    found: dict[Path, Path] = {}
    notes: tuple[Note, ...] = ()
    for markers in recordings:
        cortex = (markers.parent, f"{markers.stem}{CORTEX_ENDING}".lower())
        own = plates_beside(markers) or beside.get(cortex)
        if own is not None:
            found[markers] = own
            continue
        for name in (f"{markers.stem}{ending}{suffix}" for ending in FORCE_ENDINGS for suffix in TABLES):
            table = beside.get((markers.parent, name.lower()))
            if table is None:
                continue
            if table.stem.lower() != markers.stem.lower():
                found[markers] = table
                break
            try:
                find_plates(read_columns(table))
            except CaptureError as error:
                notes += noted(Kind.NOT_READ, f"{table.name}: no forces of {markers.name} ({error})")
            else:
                found[markers] = table
                break
    return found, notes


def _counterparts(
    recordings: Sequence[Path], inside: Collection[Path]
) -> tuple[dict[Path, Path], tuple[Note, ...]]:
    """Which file shows the motion of one that holds more: TRC of text exports, and both of C3D files.

    Two of one name that show two motions are two trials, and a note says what differs.

    Args:
        recordings: marker files.
        inside: which of them may be looked into.
    """
    c3ds = [p for p in recordings if p.suffix.lower() == ".c3d"]
    texts = [p for p in recordings if _is_text(p)]
    tables = [p for p in recordings if p.suffix.lower() == ".trc"]
    found, notes, differing = _counterparts_of([*tables, *texts], c3ds, inside)
    rest = [p for p in tables if p not in found and p not in differing]
    more, more_notes, _ = _counterparts_of(rest, [p for p in texts if p not in found], inside)
    return found | more, notes + more_notes


def _counterparts_of(
    tables: Sequence[Path], recordings: Sequence[Path], inside: Collection[Path]
) -> tuple[dict[Path, Path], tuple[Note, ...], Collection[Path]]:
    """Pairs of one name first, then by what they hold; notes; tables whose namesake is another motion."""
    namesakes = {(p.parent, p.stem.lower()): p for p in recordings}
    named = {t: namesakes[key] for t in tables if (key := (t.parent, t.stem.lower())) in namesakes}
    differing = {
        table: difference
        for table, recording in named.items()
        if table in inside and recording in inside and (difference := how_they_differ(table, recording))
    }
    notes = tuple(
        Note(
            Kind.OTHER,
            f"{table.name} and {named[table].name}: the same name, but different recordings ({difference}); "
            "read as two trials. Rename one, or name the right one in a subject.toml",
        )
        for table, difference in differing.items()
    )
    same = {table: recording for table, recording in named.items() if table not in differing}
    others = [p for p in tables if p not in named and p in inside]
    unnamed = [p for p in recordings if p not in named.values() and p in inside]
    return same | counterparts_among(others, unnamed), notes, differing


@kept_while_unchanged(most=4096)
def holds_force_columns(table: Path) -> bool:
    """Whether a table has columns of ground forces."""
    try:
        if table.suffix.lower() in TABLES:
            find_plates(read_columns(table))
    except CaptureError:
        return False
    return True


def _names(folder: Path, recordings: Sequence[Path]) -> list[str]:
    """A name for each trial: its file's, or its folder's where that says more; each one once."""
    alone = {
        place for place in {p.parent for p in recordings} if sum(p.parent == place for p in recordings) == 1
    }
    names: list[str] = []
    for path in recordings:
        of_place = path.parent != folder and path.parent in alone and not name_tokens(path.stem)
        name = path.parent.name if of_place else path.stem
        if name in names and path.parent != folder:
            name = f"{path.parent.name}_{path.stem}"
        if name in names:
            name = path.name
        names.append(name)
    return names


def _reviews(place: Path, kept: Sequence[tuple[Path, Path | None]]) -> tuple[Path, ...]:
    return reviews_in(place) if sum(markers.parent == place for markers, _ in kept) == 1 else ()


def read_subject_json(path: Path) -> Description:
    """Read a _subject.json, in which numbers may stand in quotes.

    Raises:
        CaptureError: broken JSON, or a value of the wrong kind.
    """
    entries = read_json(path)
    mass, mass_notes = entries.number("massKg", "mass")
    height, height_notes = entries.number("heightM", "height")
    age, age_notes = entries.number("ageYears", "age")
    sex, sex_notes = entries.sex()
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


def trials_of(folder: Path) -> FoundTrials:
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
            found = trials_among(place, [place])
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
