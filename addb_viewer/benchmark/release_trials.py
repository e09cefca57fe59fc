"""The benchmark's view of a release: who trains and who is tested, their motion and forces."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from jaxtyping import Float

import addb_viewer.dataset
from addb_viewer.benchmark.task import FEET, BenchmarkError, Example, Measured, Seen, SeenMarkers
from addb_viewer.dataset.columns import COORDINATE_NAMES
from addb_viewer.dataset.identifiers import file_name_of
from addb_viewer.dataset.reader import Release, column, coordinate_values, marker_places, vector
from solver.skeleton.osim import load_skeleton
from solver.skeleton.skeleton import Skeleton

Inertias = Literal["unfitted", "fitted"]
RATE = 100.0  # [Hz] of a release's grid; one at the recordings' own rates is refused
AXES = "xyz"
FEWEST_FRAMES = 3  # of a stretch: a second difference
_LABELS = ("trial_id", "frame", "counts", "phase", "activity")


@dataclass(frozen=True)
class Parts:
    """Persons by what they are for; nobody is in two."""

    train: frozenset[str]
    dev: frozenset[str]
    test: frozenset[str]


@dataclass(frozen=True)
class BenchmarkRelease:
    """A release, opened for the benchmark."""

    release: Release
    inertias: Inertias = "unfitted"
    unweighed: bool = False  # test persons too whose mass nobody entered

    @cached_property
    def subjects(self) -> dict[str, dict[str, Any]]:
        """Rows of the subjects by their id."""
        return {row["subject_id"]: row for row in self.release.subjects.to_pylist()}

    @property
    def without_entered_mass(self) -> tuple[str, ...]:
        """Subjects whose mass nobody entered: only a fitted body can be shown, which knows the forces."""
        return tuple(name for name, row in self.subjects.items() if row["mass_entered_kg"] is None)

    @property
    def testable(self) -> frozenset[str]:
        """Persons who may be tested: all, or those of whom a body can be shown that knows no force."""
        everybody = frozenset(row["person_id"] for row in self.subjects.values())
        if self.inertias == "fitted" or self.unweighed:
            return everybody
        return everybody - {self.subjects[name]["person_id"] for name in self.without_entered_mass}

    def parts(self, split: str, part: str) -> Parts:
        """Who trains, who chooses and who is tested.

        In a split into folds the tested one is `part`, the next one chooses, and all others train. Persons
        who may not be tested take part in nothing of their fold.

        Args:
            split: its name in the release.
            part: that is tested: test, dev, or a fold.

        Raises:
            BenchmarkError: nobody who may be tested is in the part, or it is the one that trains.
        """
        persons = self.release.split(split)
        names = sorted(set(persons.values()))
        if part not in names or part == "train":
            raise BenchmarkError(f"split '{split}' has no '{part}' to test; there are {', '.join(names)}")

        def of(*wanted: str) -> frozenset[str]:
            return frozenset(person for person, name in persons.items() if name in wanted)

        tested = of(part) & self.testable
        if not tested:
            raise BenchmarkError(
                f"nobody in '{part}' has an entered mass, so that only bodies could be shown that know the "
                "forces. Enter mass_kg in subject.toml and build the release again, or give --without-mass"
            )
        if "train" in names:
            return Parts(of("train"), of("dev") - of(part), tested)
        choosing = names[(names.index(part) + 1) % len(names)] if len(names) > 2 else ""
        others = [name for name in names if name not in (part, choosing)]
        return Parts(of(*others), of(choosing), tested)

    def trials(self, persons: frozenset[str], *, markers: bool = False) -> "ReleaseTrials":
        """These persons' trials.

        Args:
            persons: their ids.
            markers: whether recorded markers are shown too.
        """
        return ReleaseTrials(self, persons, markers)


def open_for_benchmark(
    path: Path, inertias: Inertias = "unfitted", *, unweighed: bool = False
) -> BenchmarkRelease:
    """A release by its folder.

    Args:
        path: its folder.
        inertias: which body is shown: "unfitted", which has the entered mass and inertias by table; or
            "fitted", whose mass and inertias were learnt from the forces, as in the paper.
        unweighed: test persons too whose mass nobody entered: their fitted body is shown.

    Raises:
        ReleaseError: the folder is no release.
        BenchmarkError: its frames are not at 100 Hz.
    """
    release = addb_viewer.dataset.open(path)
    rate = release.manifest.get("rate_hz", RATE)
    if rate != RATE:
        own = "the recordings' own rates" if rate is None else f"{rate:g} Hz"
        raise BenchmarkError(f"{path}: the benchmark needs frames at 100 Hz, this release has {own}")
    return BenchmarkRelease(release, inertias, unweighed)


@dataclass(frozen=True)
class ReleaseTrials:
    """Some persons' stretches of motion, read subject after subject; no other person's file is opened."""

    source: BenchmarkRelease
    persons: frozenset[str]
    markers: bool = False

    @property
    def fingerprint(self) -> str:
        """Of the release's manifest, which has the hash of every file, and of the skeletons shown."""
        manifest = json.dumps(self.source.release.manifest, sort_keys=True, default=str)
        return hashlib.sha256(f"{self.source.inertias} {manifest}".encode()).hexdigest()

    @property
    def subjects(self) -> tuple[str, ...]:
        """Their subjects' ids, in order."""
        rows = self.source.subjects
        return tuple(sorted(name for name, row in rows.items() if row["person_id"] in self.persons))

    def __iter__(self) -> Iterator[Example]:
        """Stretch after stretch of consecutive frames."""
        for subject in self.subjects:
            yield from self.of_subject(subject)

    def of_subject(self, subject: str) -> Iterator[Example]:
        """One subject's stretches.

        Args:
            subject: of these persons.
        """
        row = self.source.subjects[subject]
        assert row["person_id"] in self.persons, f"{subject} is not among the persons that may be opened"
        skeleton = shown_skeleton(self.source, subject)
        reading = _SubjectReading(self.source.release, row, skeleton, self.markers)
        for trial in self.source.release.trials.filter(pc.field("subject_id") == subject).to_pylist():
            yield from reading.trial(trial["trial_id"])


def shown_skeleton(source: BenchmarkRelease, subject: str) -> Skeleton:
    """The body that predictors are shown; the fitted one too where no mass was entered.

    Args:
        source: which says whether it is the fitted one.
        subject: its id.

    Raises:
        ModelError: the release's model cannot be read.
    """
    fitted = source.inertias == "fitted" or source.subjects[subject]["mass_entered_kg"] is None
    end = "osim" if fitted else "unfitted.osim"
    return load_skeleton(source.release.path / "models" / f"{file_name_of(subject)}.{end}")


@dataclass(frozen=True)
class _SubjectReading:
    """One subject's rows as arrays."""

    release: Release
    row: Mapping[str, Any]
    skeleton: Skeleton
    markers: bool

    def trial(self, trial_id: str) -> Iterator[Example]:
        motion = self._rows("kinematics", trial_id, ["frame", *self._columns("q")])
        frames = self._rows("frames", trial_id, [*_LABELS, *self._columns("tau"), *_measured_columns()])
        number = np.asarray(motion["frame"].to_numpy())
        if not np.array_equal(number, frames["frame"].to_numpy()):
            raise BenchmarkError(f"{trial_id}: tables kinematics and frames have different frames")
        seen, measured = self._seen(motion), self._measured(frames)
        marked = self._markers(trial_id, number) if self.markers else None
        starts = [0, *(np.flatnonzero(np.diff(number) != 1) + 1), len(number)]
        for start, end in pairwise(starts):
            if end - start >= FEWEST_FRAMES:
                yield Example(
                    person_id=self.row["person_id"],
                    subject_id=self.row["subject_id"],
                    trial_id=trial_id,
                    frame=number[start:end],
                    seen=_part_of_seen(seen, marked, slice(start, end)),
                    measured=_part_of_measured(measured, slice(start, end)),
                )

    def _seen(self, motion: pa.Table) -> Seen:
        right, left = self.row["contact_bodies"]
        q = self._values(motion, "q")
        return Seen(q, RATE, self.skeleton, float(self.row["height_m"]), (right, left))

    def _measured(self, frames: pa.Table) -> Measured:
        def feet(pattern: str) -> Float[np.ndarray, "frames 2 3"]:
            return np.stack([vector(frames, pattern.format(side, "{}")) for side in FEET], axis=1)

        return Measured(
            counts=column(frames, "counts") > 0,
            phase=np.nan_to_num(column(frames, "phase"), nan=-1).astype(int),
            activity=np.array(frames["activity"].to_pylist(), dtype=object),
            mass_kg=float(self.row["mass_kg"]),
            force=feet("grf_{}_{}_N"),
            moment=feet("grm_{}_{}_Nm"),
            foot_ground=feet("foot_{}_{}_m"),
            cop_ground=feet("cop_{}_{}_m"),
            com_acceleration=vector(frames, "com_a_{}_m_s2"),
            torque=self._values(frames, "tau"),
        )

    def _markers(self, trial_id: str, number: np.ndarray) -> SeenMarkers:
        columns = ["marker", "frame", *(f"measured_{axis}_m" for axis in AXES)]
        rows = self._rows("markers", trial_id, columns)
        known = tuple(sorted(set(rows["marker"].to_pylist())))
        return SeenMarkers(known, marker_places(rows, number, known))

    def _rows(self, table: str, trial_id: str, columns: list[str]) -> pa.Table:
        scan = self.release.scan(table, [self.row["subject_id"]])
        return scan.to_table(columns=columns, filter=pc.field("trial_id") == trial_id)

    @cached_property
    def _places(self) -> dict[str, int]:
        """Of coordinates without a column of their own, in the lists of others."""
        rows = self.release.table("coordinates").filter(
            (pc.field("subject_id") == self.row["subject_id"]) & (pc.field("list") == "other")
        )
        return {row["name"]: row["place"] for row in rows.to_pylist()}

    def _columns(self, prefix: str) -> list[str]:
        own = [f"{prefix}_{name}" for name in self.skeleton.dofs if name in COORDINATE_NAMES]
        return [*own, f"{prefix}_other"] if self._places else own

    def _values(self, rows: pa.Table, prefix: str) -> Float[np.ndarray, "frames dofs"]:
        for name in self.skeleton.dofs:
            if name not in COORDINATE_NAMES and name not in self._places:
                raise BenchmarkError(f"{self.row['subject_id']}: no column for the coordinate {name}")
        return coordinate_values(rows, prefix, self.skeleton.dofs, self._places)


def _measured_columns() -> list[str]:
    of_feet = [
        pattern.format(side, axis)
        for pattern in ("grf_{}_{}_N", "grm_{}_{}_Nm", "foot_{}_{}_m", "cop_{}_{}_m")
        for side in FEET
        for axis in AXES
    ]
    return [*of_feet, *(f"com_a_{axis}_m_s2" for axis in AXES)]


def _part_of_seen(seen: Seen, markers: SeenMarkers | None, some: slice) -> Seen:
    """Arrays of its own that nobody can write to."""
    q = seen.q[some].copy()
    q.setflags(write=False)
    shown = None if markers is None else replace(markers, position_ground=markers.position_ground[some])
    return replace(seen, q=q, markers=shown)


def _part_of_measured(measured: Measured, some: slice) -> Measured:
    arrays: dict[str, Any] = {
        name: value[some] for name, value in vars(measured).items() if isinstance(value, np.ndarray)
    }
    return replace(measured, **arrays)
