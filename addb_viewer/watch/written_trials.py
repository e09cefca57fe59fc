"""Which trials of a watched folder are written: their files rest, and hold as much as they say."""

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from solver.capture.capture import Subject
from solver.capture.formats.c3d_contents import read_header
from solver.capture.formats.qtm_tsv import force_files
from solver.capture.formats.recording_files import is_force_table, is_recording
from solver.capture.subject.opened_subject import open_subject
from solver.capture.subject.same_motion import is_static_file
from solver.capture.subject.subject_layout import DESCRIPTIONS, folders_below
from solver.common.errors import CaptureError

REST_S = 1.0  # unchanged for so long, a file counts as written
FORCES_S = 4.0  # markers alone wait so long for a file of forces: programs write one after the other
# once its files have rested for so long, one that holds less than it says is taken as it is, and one that was
# not replaced with the others stays
CUT_S = 20.0
TOLD_S = 5.0  # what cannot be opened, or is missing, for so long is said
AGAIN_S = 1.0  # what cannot be opened is tried again
Seen = tuple[int, int]  # size [bytes] and time of the last change [ns]
Digests = tuple[str, ...]  # SHA-256 of each file of a trial
NO_LINES: Mapping[str, Sequence[Digests]] = {}


@dataclass(frozen=True)
class WrittenTrial:
    """A trial whose files rest."""

    subject: Path
    name: str
    files: tuple[Path, ...]
    digest: str  # SHA-256 of each
    rested: float  # [s] since when, on the watcher's clock
    static: bool = False
    kept: tuple[Path, ...] = ()  # of a former recording under this name, while the others were replaced


class WatchedSubject:
    """One subject's folder: what its files were when they were last looked at, and since when."""

    def __init__(self, folder: Path, judged: Mapping[str, Sequence[Digests]] = NO_LINES) -> None:
        """Nothing has been seen.

        Args:
            folder: of the subject.
            judged: by trial, the files that the log knows, the oldest first.
        """
        self.folder = folder
        self.subject: Subject | None = None
        self.trouble = ""  # why it cannot be opened, once that has lasted
        self._seen: dict[Path, Seen] = {}
        self._since: dict[Path, float] = {}
        self._taken: dict[str, tuple[tuple[Seen, ...], str]] = {}  # by trial, its files as handed out, digest
        self._former = {name: list(digests) for name, digests in judged.items()}
        self._digests: dict[Path, tuple[Seen, str]] = {}
        self._missing: dict[
            Path, float
        ] = {}  # files that are awaited, and since when; inf: that has been told
        self._opened: dict[Path, Seen] = {}  # files that rested when it was opened last
        self._again = 0.0  # when it is tried once more
        self._troubled: float | None = None

    def written(self, now: float) -> list[WrittenTrial]:
        """Trials that are written and were not handed out, or were replaced since.

        Args:
            now: [s] on any steady clock.
        """
        self._look(now)
        resting = {file: self._seen[file] for file, since in self._since.items() if now - since >= REST_S}
        if resting and (resting != self._opened or (self.subject is None and now >= self._again)):
            self._open(resting, now)
        found = [one for one in self._trials() if self._is_written(*one, resting, now)]
        return [trial for one in found if (trial := self._hand_out(*one)) is not None]

    def is_current(self, trial: WrittenTrial) -> bool:
        """Whether its files are still those that were handed out."""
        return self._taken.get(trial.name) == (self._as_seen(trial.files), trial.digest)

    def missing(self, now: float) -> list[Path]:
        """Files that are awaited for some time, each once."""
        awaited = () if self.subject is None else self.subject.awaited
        self._missing = {file: self._missing.get(file, now) for file in awaited}
        due = [file for file, since in self._missing.items() if now - since >= TOLD_S]
        self._missing |= dict.fromkeys(due, float("inf"))
        return due

    def _look(self, now: float) -> None:
        named = [file for _, files, _ in self._trials() for file in files]  # they may lie elsewhere
        named += () if self.subject is None else self.subject.awaited
        for file in {*_measured(self.folder), *named}:
            try:
                stat = file.stat()
            except OSError:
                continue
            seen = stat.st_size, stat.st_mtime_ns
            if self._seen.get(file) != seen:
                self._seen[file], self._since[file] = seen, now

    def _open(self, resting: dict[Path, Seen], now: float) -> None:
        """Find the trials; while a file is being written that often fails, and is tried again."""
        self._opened, self._again = resting, now + AGAIN_S
        try:
            self.subject, self._troubled, self.trouble = open_subject(self.folder, awaits=True), None, ""
        except Exception as error:  # whatever half a file can break
            self.subject, self._troubled = None, self._troubled or now
            self.trouble = " ".join(str(error).split()) if now - self._troubled >= TOLD_S else ""

    def _trials(self) -> Iterator[tuple[str, tuple[Path, ...], bool]]:
        if self.subject is None:
            return
        trials = self.subject.trials
        alone = all(is_static_file(files.markers, self.folder) for files in trials)  # it is the first
        for files in trials:
            forces = force_files(files.forces) if files.forces else ()
            yield files.name, tuple(dict.fromkeys((files.markers, *forces))), alone
        statics = (self.subject.static, *self.subject.other_statics)
        yield from ((path.stem, (path,), True) for path in statics if path is not None)

    def _is_written(
        self, name: str, files: tuple[Path, ...], static: bool, resting: Mapping[Path, Seen], now: float
    ) -> bool:
        if any(file not in resting for file in files):
            return False
        if self._taken.get(name, ((), ""))[0] == self._as_seen(files):
            return False
        since = max(self._since[file] for file in files)
        may_get_forces = files[0].suffix.lower() == ".trc" and len(files) == 1 and not static
        patience = CUT_S if self._has_forces() else FORCES_S
        if may_get_forces and (len(resting) < len(self._since) or now - since < patience):
            return False
        if now - since >= CUT_S:
            return True
        try:
            return not any(map(is_cut, files)) and not any(self._kept(name, self._digests_of(files)))
        except OSError:
            return False

    def _has_forces(self) -> bool:
        """Whether another trial has, or some are awaited: then this one will have some too."""
        subject = self.subject
        return subject is not None and bool(subject.awaited or any(t.forces for t in subject.trials))

    def _hand_out(self, name: str, files: tuple[Path, ...], static: bool) -> WrittenTrial | None:
        try:
            digests, whole = self._digests_of(files), not any(map(is_cut, files))
        except OSError:
            return None
        kept = tuple(f for f, old in zip(files, self._kept(name, digests), strict=False) if old)
        self._taken[name] = self._as_seen(files), " ".join(digests)
        if whole:  # what is cut off may go on
            self._former.setdefault(name, []).append(digests)
        since = max(self._since[file] for file in files)
        return WrittenTrial(self.folder, name, files, " ".join(digests), since, static, kept)

    def _digests_of(self, files: tuple[Path, ...]) -> Digests:
        for file in files:
            if self._digests.get(file, (None, ""))[0] != self._seen[file]:
                self._digests[file] = self._seen[file], hashlib.sha256(file.read_bytes()).hexdigest()
        return tuple(self._digests[file][1] for file in files)

    def _kept(self, name: str, digests: Digests) -> tuple[bool, ...]:
        return of_former(digests, self._former.get(name, ()))

    def _as_seen(self, files: tuple[Path, ...]) -> tuple[Seen, ...]:
        return tuple(self._seen.get(file, (0, 0)) for file in files)


def of_former(digests: Digests, former: Sequence[Digests]) -> tuple[bool, ...]:
    """Of each file, whether it is of a former recording while others are not; empty where all are of one.

    Args:
        digests: of the files as they are.
        former: those that were judged before, the oldest first; such pairs are among them.
    """
    together: list[Digests] = []
    mixed: list[tuple[bool, ...]] = []
    for one in (*former, digests):
        shared = [tuple(a == b for a, b in zip(one, other, strict=False)) for other in together]
        mixed = [] if one in together else [same for same in shared if any(same) and not all(same)]
        together += [] if mixed else [one]
    return mixed[0] if mixed else ()


def _measured(folder: Path) -> Iterator[Path]:
    """Files of markers, forces and descriptions of a subject; none of what this program writes."""
    for place in (folder, *folders_below(folder)):
        for file in place.iterdir():
            if not file.name.startswith(".") and file.is_file() and _is_read(file):
                yield file


def _is_read(file: Path) -> bool:
    return file.name in DESCRIPTIONS or is_recording(file) or is_force_table(file)


_ROW = re.compile(rb"^[ \t]*-?[\d.]", re.MULTILINE)
_STATED = {  # how many rows of numbers a file says that it has
    ".mot": re.compile(rb"^nRows\s*=\s*(\d+)", re.MULTILINE),
    ".sto": re.compile(rb"^nRows\s*=\s*(\d+)", re.MULTILINE),
    ".forces": re.compile(rb"^NumberOfSamples\s*=\s*(\d+)", re.MULTILINE),
    ".tsv": re.compile(rb"^NO_OF_FRAMES[\t;,](\d+)", re.MULTILINE),
    ".trc": re.compile(rb"^DataRate[^\n]*\n[ \t]*[\d.]+\s+[\d.]+\s+(\d+)", re.MULTILINE),
}


def is_cut(file: Path) -> bool:
    """Whether a file holds fewer rows, or frames, than its head says."""
    if file.suffix.lower() == ".c3d":
        return _is_cut_c3d(file)
    pattern = _STATED.get(file.suffix.lower())
    if pattern is None:
        return False
    text = file.read_bytes()
    stated = pattern.search(text)
    return stated is not None and len(_ROW.findall(text, stated.end())) < int(stated[1])


def _is_cut_c3d(file: Path) -> bool:
    try:
        header = read_header(file)
    except CaptureError:
        return True
    return header.frames is not None and header.frames_held < header.frames


def subjects_below(folder: Path) -> list[Path]:
    """The watched folder itself where it holds recordings or a description, else the folders in it that do.

    The files of one subject may lie in folders of its own, as in `S01/MarkerData`.
    """
    if _is_subject(folder):
        return [folder]
    return [place for place in folders_below(folder, 1) if any(True for _ in _measured(place))]


def _is_subject(folder: Path) -> bool:
    return (folder / "trials").is_dir() or any(_is_read(p) for p in folder.iterdir() if p.is_file())
