"""A subject's recordings: opened from a folder or a file, made from arrays, or simulated."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from addb_viewer.api.arrays_folder import Person, write_recordings
from addb_viewer.api.labelled import Series, analog_series
from addb_viewer.api.recording import Plate, Recording, capture_from, recording_from
from addb_viewer.jobs.reviewing import capture_of, trial_of
from addb_viewer.jobs.solving import Job, job_for
from solver.capture.capture import Subject as OpenedSubject
from solver.capture.capture import UnusedFile
from solver.capture.formats.analog_channels import read_analog
from solver.capture.formats.b3d.places import subject_folder_of
from solver.common.errors import CaptureError
from solver.common.notes import Note
from solver.fitting.results.store import default_folder
from solver.fitting.settings import settings_from


@dataclass(frozen=True, eq=False, repr=False)
class OpenedRecordings:
    """One person's recordings: where they lie, and what is said about them.

    Results, flags and decisions lie on the disk, where the command line and the app find them too.
    """

    folder: Path  # of the recordings
    results: Path  # folder of the results
    settings: Path | Mapping[str, Any] | None = None  # instead of the folder's settings.toml
    marker_map: Path | None = None  # what labels mean, instead of the folder's markers.toml
    ignore_reviews: bool = False
    _keeps: object = field(default=None)  # a temporary folder, removed with the last who needs it

    @classmethod
    def open(
        cls,
        path: str | Path,
        *,
        results: str | Path | None = None,
        settings: str | Path | Mapping[str, Any] | None = None,
        marker_map: str | Path | None = None,
        ignore_reviews: bool = False,
    ) -> Self:
        """Open a subject's folder or a .b3d file; recordings are read when something is computed.

        Args:
            path: folder of the recordings and, if any, the model; or a .b3d file.
            results: where results go; None: `results` in the folder, or beside the .b3d file.
            settings: a TOML file, or tables as in it, `{"detection": {"confidence": 0.8}}`; None: the
                folder's own.
            marker_map: a file that says what labels mean; None: the folder's.
            ignore_reviews: leave out what people flagged, here or in a review.json.

        Raises:
            SolverError: no such folder, or nothing in it to fit.
        """
        folder = subject_folder_of(Path(path))
        subject = cls(
            folder,
            default_folder(folder) if results is None else Path(results),
            settings if settings is None or isinstance(settings, Mapping) else Path(settings),
            None if marker_map is None else Path(marker_map),
            ignore_reviews,
        )
        subject._job()
        return subject

    @classmethod
    def from_arrays(
        cls,
        markers: np.ndarray,
        marker_names: Sequence[str],
        times: np.ndarray,
        *,
        plates: Sequence[Plate] = (),
        up: str = "y",
        name: str = "trial",
        mass_kg: float | None = None,
        height_m: float | None = None,
        sex: str | None = None,
        model: str | Path | None = None,
        static: Recording | None = None,
        folder: str | Path | None = None,
        settings: Mapping[str, Any] | None = None,
        check: bool = True,
    ) -> Self:
        """A subject of one trial that lies in memory; `from_recordings` takes several.

        Args:
            markers: [frames, markers, 3] [m], NaN where not seen.
            marker_names: of each.
            times: of each frame [s], uniform.
            plates: force plates in the markers' axes and on their clock.
            up: the axis that points up: "y", "z", "-x", ...
            name: of the trial.
            mass_kg: of the person; None: the forces weigh them.
            height_m: likewise; None: from the legs.
            sex: "male" or "female", where known.
            model: an OpenSim model; None: the default full body.
            static: somebody who stands still, to scale the body with.
            folder: where recordings and results go; None: a temporary folder, removed with the last of the
                subject and its fits.
            settings: tables as in settings.toml.
            check: refuse arrays that contradict units, axes or signs as stated here.

        Raises:
            CaptureError: shapes or times do not fit, or a check fails.
        """
        one = Recording(markers, marker_names, times, plates, up)
        return cls.from_recordings(
            {name: one},
            mass_kg=mass_kg,
            height_m=height_m,
            sex=sex,
            model=model,
            static=static,
            folder=folder,
            settings=settings,
            check=check,
        )

    @classmethod
    def from_recordings(
        cls,
        recordings: Mapping[str, Recording],
        *,
        mass_kg: float | None = None,
        height_m: float | None = None,
        sex: str | None = None,
        model: str | Path | None = None,
        static: Recording | None = None,
        folder: str | Path | None = None,
        settings: Mapping[str, Any] | None = None,
        check: bool = True,
    ) -> Self:
        """A subject of several trials that lie in memory.

        Args:
            recordings: by trial.
            mass_kg: of the person; this and the others as for `from_arrays`.
            height_m: of the person.
            sex: of the person.
            model: an OpenSim model.
            static: to scale the body with.
            folder: where recordings and results go.
            settings: tables as in settings.toml.
            check: refuse contradictions.

        Raises:
            CaptureError: there is none, shapes or times do not fit, or a check fails.
        """
        person = Person(mass_kg, height_m, sex, None if model is None else Path(model))
        if not recordings:
            raise CaptureError("no recordings; give one a trial, by name.")
        captures = [capture_from(name, one, check=check) for name, one in recordings.items()]
        standing = None if static is None else capture_from("static", static, check=check)
        keeps = None if folder else tempfile.TemporaryDirectory(prefix="addb-viewer-")
        place = Path(folder) if folder else Path(keeps.name, "subject")  # type: ignore[union-attr]
        write_recordings(place, captures, standing, person)
        return cls(place, default_folder(place), settings, _keeps=keeps)

    @classmethod
    def demo(cls, folder: str | Path | None = None, *, trials: Sequence[str] = ("walk",)) -> Self:
        """A synthetic person who walks over force plates and misses one of them, as in `addb-viewer demo`.

        Args:
            folder: to write into; None: a temporary one.
            trials: of "static", "walk", "squat", "run".

        Raises:
            CaptureError: the folder holds something else, or cannot be written to.
        """
        from addb_viewer.jobs.demo import make_demo  # noqa: PLC0415 (the simulator; few ask)

        keeps = None if folder else tempfile.TemporaryDirectory(prefix="addb-viewer-")
        place = Path(folder) if folder else Path(keeps.name, "subject")  # type: ignore[union-attr]
        make_demo(place, trials=trials)
        return cls(place, default_folder(place), _keeps=keeps)

    def __repr__(self) -> str:
        """Name and trials."""
        return f"<Subject {self.name}: {', '.join(self.trials)}>"

    @property
    def name(self) -> str:
        """The folder's name, or the file's without its ending."""
        return self._opened.name

    @property
    def trials(self) -> tuple[str, ...]:
        """Names of the trials."""
        return tuple(trial.name for trial in self._opened.trials)

    @property
    def mass_kg(self) -> float | None:
        """As entered [kg]; None: the forces weigh the person."""
        return self._opened.mass_kg

    @property
    def height_m(self) -> float | None:
        """As entered [m]; None: from the legs."""
        return self._opened.height_m

    @property
    def notes(self) -> tuple[Note, ...]:
        """What was assumed or ignored about the folder."""
        return self._job().subject.notes

    @property
    def unused(self) -> tuple[UnusedFile, ...]:
        """Files of the folder that no fit reads, and why."""
        return self._opened.unused

    def recording(self, trial: str) -> Recording:
        """A trial as it is read: metres, newtons, y up, forces on the person.

        Raises:
            CaptureError: no such trial, or its files cannot be read.
        """
        opened = self._opened
        return recording_from(capture_of(opened, trial_of(opened, trial)))

    def analog(self, trial: str) -> Series:
        """EMG, triggers and other channels of a trial that are no force plate's: raw, in the file's units.

        Raises:
            CaptureError: no such trial, or its files cannot be read.
        """
        files = trial_of(self._opened, trial)
        return analog_series(read_analog([file for file in (files.markers, files.forces) if file]))

    @property
    def _opened(self) -> OpenedSubject:
        return self._job(without_extension=True).subject

    def _job(self, *, trials: Sequence[str] | None = None, without_extension: bool = False) -> Job:
        tables = self.settings if isinstance(self.settings, Mapping) else None
        return job_for(
            self.folder,
            out=self.results,
            trials=trials,
            settings_file=None if isinstance(self.settings, Mapping) else self.settings,
            settings=None if tables is None else settings_from(tables, "settings"),
            map_file=self.marker_map,
            ignore_review=self.ignore_reviews,
            without_extension=without_extension,
        )
