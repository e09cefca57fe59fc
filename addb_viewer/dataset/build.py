"""Folders of subjects in, a release out: scan, fit what is not yet done, put it together, swap."""

import hashlib
import json
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from addb_viewer.dataset.build_task import LeftOut, Receipt, Task, valid_receipt
from addb_viewer.dataset.finishing import finished, recovered
from addb_viewer.dataset.identifiers import without_places
from addb_viewer.dataset.reader import MANIFEST, read_manifest
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_subject import BuildOptions, hash_of_person
from addb_viewer.dataset.release_tables import FORMAT_VERSION, schema_json
from addb_viewer.dataset.scanning import WITHDRAWN, ScannedSubject, scan, wanted_files
from addb_viewer.dataset.subject_task import ATTEMPTS, done_apart, lost
from addb_viewer.dataset.trial_labels import fingerprint, named_causes
from addb_viewer.jobs.accepted_extension import extension_for_solve
from addb_viewer.jobs.force_reviews import reviews_for_solve
from addb_viewer.jobs.processes import Engine
from addb_viewer.jobs.review_store import whole_log
from solver.common.disk_errors import writing_failed
from solver.fitting.provenance import provenance_of
from solver.fitting.results.store import default_folder
from solver.fitting.settings import as_dict, settings_for

BYTES_PER_FRAME = 16_000  # of all files of a subject: 9 to 13 kB with 40 to 60 markers
PROGRAM = 5  # raised when the same inputs give other files


@dataclass(frozen=True)
class Plan:
    """What a build will do."""

    subjects: tuple[ScannedSubject, ...]
    strange: tuple[LeftOut, ...]  # folders that are no subjects

    @property
    def wanted(self) -> tuple[ScannedSubject, ...]:
        """Subjects of which something is taken."""
        return tuple(one for one in self.subjects if one.trials)

    def fitted_to_forces(self, options: BuildOptions) -> "Plan":
        """Without those who withdrew from an earlier build."""
        gone = tuple(
            ScannedSubject(one.subject, one.who, left_out=(WITHDRAWN,))
            if options.leaves_out(one.who.person_id)
            else one
            for one in self.subjects
        )
        return replace(self, subjects=gone)

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """What is known before anything is fitted."""
        return (*self.strange, *(row for one in self.subjects for row in one.left_out))

    @property
    def frames(self) -> int:
        """Of all wanted trials, at their own rates."""
        return sum(one.frames for one in self.wanted)

    @property
    def bytes(self) -> int:
        """How large the files will be, about."""
        return self.frames * BYTES_PER_FRAME


def planned(
    roots: Sequence[Path], options: BuildOptions, told: Callable[[str], None] = lambda _: None
) -> Plan:
    """Read what there is and decide what is taken; nothing is written.

    Args:
        roots: folders of subjects, or subjects.
        options: of the release.
        told: whose files are read.

    Raises:
        ReleaseError: two subjects have one name, or a person of `--without` is in no subject.
        CaptureError: a root is missing, or holds no subject.
    """
    subjects, strange = scan(roots, options, told)
    persons = {one.who.person_id for one in subjects}
    missing = sorted(
        one for one in set(options.without) - persons if hash_of_person(one) not in options.withdrawn
    )
    if missing:
        raise ReleaseError(
            f"--without {missing[0]}: nobody is called that; persons are SOURCE/PERSON, as {min(persons)}"
        )
    return Plan(subjects, strange)


def continuing(options: BuildOptions, out: Path) -> BuildOptions:
    """The options, with the withdrawals that the release at this place remembers.

    Args:
        options: of the build.
        out: folder of the release; it need not be there.
    """
    if not (out / MANIFEST).is_file():
        return options
    return replace(options, withdrawn=tuple(read_manifest(out).get("withdrawn", ())))


def build(
    plan: Plan,
    out: Path,
    options: BuildOptions,
    engine: Engine,
    *,
    time_out_s: float | None = None,
    told: Callable[[str], None] = lambda _: None,
    published: str | None = None,
) -> dict[str, Any]:
    """Make the release, or bring it up to date; what is done already is taken as it is.

    Args:
        plan: of the same options.
        out: folder of the release; `OUT.work` keeps what workers make.
        options: of the release.
        engine: that does the work.
        time_out_s: after which a subject is given up; None: never.
        told: how far it is, a line at a time.
        published: the day, for croissant.json.

    Returns:
        The manifest.

    Raises:
        ReleaseError: the folder holds something else or cannot be written to, or nothing is left to release.
    """
    recovered(out)
    previous = _previous(out)
    options = continuing(options, out)
    plan = plan.fitted_to_forces(options)
    work = out.with_name(out.name + ".work")
    _check_place(work, plan)
    began, clock = datetime.now(UTC), time.monotonic()
    tasks = [task_of(one, options, work) for one in plan.wanted]
    receipts: dict[str, Receipt] = {}
    waiting = []
    for task in tasks:
        receipt = valid_receipt(task.out, task.key)
        if receipt is None:
            waiting.append(task)
        else:
            receipts[task.who.subject_id] = receipt
    waiting.sort(key=lambda task: -task.frames)  # a long one that comes last would keep one worker alone
    if receipts:
        told(f"{len(receipts)} of {len(tasks)} subjects are done already")
    progress = _Progress(len(waiting), sum(task.frames for task in waiting), told)

    def done(task: Task, receipt: Receipt | None) -> None:
        if receipt is None:
            receipt = lost(task, "worker_died", f"its worker died {ATTEMPTS} times")
        elif receipt.files and valid_receipt(task.out, task.key) is None:
            raise ReleaseError(
                f"{task.who.subject_id}: a worker did it, and {task.out} is not to be seen here. Client and "
                "workers have to share the folder of the release, under one path."
            )
        receipts[task.who.subject_id] = receipt
        progress.one_more(task, receipt)

    try:
        engine.run(waiting, partial(done_apart, time_out_s=time_out_s), done)
    except OSError as error:
        raise ReleaseError(writing_failed(work, error)) from error
    left = [*plan.left_out, *(row for one in receipts.values() for row in one.left_out)]
    left += [one.failed for one in receipts.values() if one.failed]
    left = [_without_places(row, plan) for row in left]
    inside = {name: one for name, one in sorted(receipts.items()) if one.files}
    if not inside:
        why = ", ".join(sorted({row.reason for row in left}))
        raise ReleaseError(f"nothing is left to release ({why}); --dry-run says what is left out and why")
    log = {
        "began": began.isoformat(timespec="seconds"),
        "seconds": time.monotonic() - clock,
        "subjects": {
            name: {"seconds": one.seconds, "peak_MB": one.peak_MB} for name, one in sorted(receipts.items())
        },
    }
    try:
        manifest = finished(out, work, inside, left, options, previous=previous, log=log, published=published)
    except OSError as error:
        raise ReleaseError(writing_failed(out, error)) from error
    _without_old_parts(work, {task.key for task in tasks})
    return manifest


def task_of(one: ScannedSubject, options: BuildOptions, work: Path) -> Task:
    """What a worker is to do for a subject; its key changes with anything that its files depend on.

    Args:
        one: the subject.
        options: of the release.
        work: folder in which each task has a folder.

    Raises:
        SolverError, ReviewError: settings, reviews or accepted causes cannot be read.
    """
    subject, files = one.subject, wanted_files(one)
    reviews, _ = reviews_for_solve(subject, files)
    extension, _ = extension_for_solve(subject, files, default_folder(subject.folder))
    made_from = {
        "program": PROGRAM,
        "format": FORMAT_VERSION,
        "schema": schema_json(),
        "provenance": provenance_of(subject, files, reviews, extension),
        "settings": as_dict(settings_for(subject.folder)),
        "rate_hz": options.rate_hz,
        "names": options.names,
        "b3d": options.b3d,
        "who": asdict(one.who),
        "causes": fingerprint(named_causes(subject)),
        "labels": [repr(edit) for edit in whole_log(subject.folder).edits],
    }
    key = hashlib.sha256(json.dumps(made_from, sort_keys=True, default=str).encode()).hexdigest()
    names = tuple(trial.name for trial in files)
    return Task(key, subject.folder, one.who, names, options, work / key, one.frames)


def _without_places(row: LeftOut, plan: Plan) -> LeftOut:
    """As a release tells it: the reason in full, but not where the files lay."""
    folders = {one.subject.folder for one in plan.subjects}
    return replace(row, detail=without_places(row.detail, folders | {folder.parent for folder in folders}))


def _previous(out: Path) -> Mapping[str, Any] | None:
    """Manifest of the release that lies there; refuses a folder of something else."""
    if not out.exists():
        return None
    if out.is_dir() and not any(out.iterdir()):
        out.rmdir()
        return None
    if not (out / MANIFEST).is_file():
        raise ReleaseError(f"{out}: holds something else than a release. Give a new folder as --out.")
    return read_manifest(out)


def _check_place(work: Path, plan: Plan) -> None:
    """Refuse a place that cannot be written to, or that is too small, before time is spent."""
    try:
        work.mkdir(parents=True, exist_ok=True)
        trial = work / ".writable"
        trial.write_bytes(b"")
        trial.unlink()
        free = shutil.disk_usage(work).free
    except OSError as error:
        raise ReleaseError(writing_failed(work.parent, error)) from error
    if free < plan.bytes:
        raise ReleaseError(
            f"{work.parent}: {_size(free)} are free, the release needs about {_size(plan.bytes)}. "
            "Make room, or give another --out."
        )


def _size(bytes_: int) -> str:
    return f"{bytes_ / 1e9:.1f} GB" if bytes_ >= 1e9 else f"{bytes_ / 1e6:.1f} MB"


def _without_old_parts(work: Path, keys: set[str]) -> None:
    for place in work.iterdir():
        if place.is_dir() and place.name not in keys:
            shutil.rmtree(place, ignore_errors=True)


class _Progress:
    """How far a build is, and how long it will take, by frames."""

    def __init__(self, subjects: int, frames: int, told: Callable[[str], None]) -> None:
        self._subjects, self._frames, self._told = subjects, frames, told
        self._done = self._done_frames = 0
        self._began = time.monotonic()

    def one_more(self, task: Task, receipt: Receipt) -> None:
        """A subject has ended."""
        self._done += 1
        self._done_frames += task.frames
        took = time.monotonic() - self._began
        left = took * (self._frames - self._done_frames) / max(self._done_frames, 1)
        what = f"left out, {receipt.failed.reason}" if receipt.failed else f"{task.frames} frames"
        rest = f"; about {_duration(left)} left" if self._done < self._subjects else ""
        self._told(f"{self._done}/{self._subjects} {task.who.subject_id}: {what}{rest}")


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
