"""Real recordings whose activity is known from the description of their folder in $ADDB_DATA/README.md."""

import pickle
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

from benchmarks.activities.examples import Example
from benchmarks.recordings import data_folder
from solver.capture.capture import Subject, TrialFiles
from solver.capture.subject.subject import open_subject
from solver.fitting import pipeline
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.settings import settings_for
from solver.gait.activities import load_of
from solver.gait.activity import Activity, Kind
from solver.skeleton.skeleton import Skeleton

STATIC = "its static trial"


@dataclass(frozen=True)
class Known:
    """What a description says about a trial, or about a part of it."""

    source: str  # laboratory or publication
    folder: str
    trial: str
    activity: Activity
    kind: Kind | None = None
    seconds: tuple[float, float] | None = None  # from the first frame; None: all of it


W, R, J = Activity.WALKING, Activity.RUNNING, Activity.JUMP
KNOWN = (
    Known("Dembia", "walk_rajagopal2015", "walk", W, Kind.OVERGROUND),
    Known("gait2354", "walk_gait2354_subject01", "walk1", W, Kind.TREADMILL),
    Known("step width", "walk_treadmill_stepwidth", "example1", W, Kind.TREADMILL),
    Known("Hamner", "run_treadmill_hamner2013_subject04", "run400", R, Kind.TREADMILL),
    Known("Dorn", "sprint_overground_dorn2012_JA1_9ms", "run0900cms", R, Kind.OVERGROUND),
    Known("Camargo", "overground_camargo2021_AB06", "levelground_ccw_fast_01_01",
          Activity.STANDING, Kind.BOTH_FEET, (1.2, 4.0)),
    Known("Camargo", "overground_camargo2021_AB06", "levelground_ccw_fast_01_01",
          W, Kind.OVERGROUND, (5.6, 12.3)),
    Known("Camargo", "overground_camargo2021_AB06", "levelground_ccw_fast_01_01",
          Activity.STANDING, Kind.BOTH_FEET, (13.3, 15.3)),
    Known("Falisse", "overground_falisse_AdDB", "Gait_7", W, Kind.OVERGROUND),
    Known("Arnold", "synthetic_arnold2013_subject01", "trial", W),
    Known("Lencioni", "anomalies/tiziana2019_lencioni", "trial", W, Kind.OVERGROUND),
    Known("OpenCap", "opencap_subject4", "walking1", W, Kind.OVERGROUND),
    Known("OpenCap", "opencap_subject4", "walkingTO1", W, Kind.OVERGROUND),
    Known("OpenCap", "opencap_subject4", "squats1", Activity.SQUAT),
    Known("OpenCap", "opencap_subject4", "STS1", Activity.SIT_TO_STAND),
    Known("OpenCap", "opencap_subject4", "DJ1", J, Kind.DROP_JUMP, (1.0, 2.68)),
    Known("OpenCap", "opencap_subject6", "walking1", W, Kind.OVERGROUND),
    Known("OpenCap", "opencap_reviewed", "DJ1", J, Kind.DROP_JUMP, (0.76, 2.3)),
    Known("Gordon", "exo_apo_gordon", "NE21", W, Kind.TREADMILL),
    Known("Gordon", "exo_apo_gordon", "ET21", W, Kind.TREADMILL),
    Known("La Trobe", "c3d_lab_trials/lasem_FAILT01", "Walk01", W, Kind.OVERGROUND),
    Known("La Trobe", "c3d_lab_trials/lasem_FAILT01", "SLDJ06", J, Kind.DROP_JUMP, (0.6, 1.63)),
    Known("opensim-core", "c3d_lab_trials/opensim_core", "doubleLegLanding", J, Kind.DROP_JUMP, (1.3, 2.5)),
    *(
        Known(source, folder, STATIC, Activity.STANDING, Kind.BOTH_FEET)
        for source, folder in (
            ("gait2354", "walk_gait2354_subject01"),
            ("OpenCap", "opencap_subject4"),
            ("OpenCap", "opencap_subject6"),
            ("Gordon", "exo_apo_gordon"),
            ("La Trobe", "c3d_lab_trials/lasem_FAILT01"),
            ("opensim-core", "c3d_lab_trials/opensim_core"),
        )
    ),
)  # fmt: skip


def recorded(folder: Path) -> Iterator[Example]:
    """All of them, by the motion of their markers; fits are kept in a folder, since they take minutes.

    Args:
        folder: made if it does not exist.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for known in KNOWN:
        file = folder / f"{known.folder.replace('/', '__')}.pickle"
        if not file.exists():
            trials = sorted({k.trial for k in KNOWN if k.folder == known.folder})
            file.write_bytes(pickle.dumps(_tracked(known.folder, trials)))
        skeleton, trial, mass = pickle.loads(file.read_bytes())[known.trial]
        motion, contacts = trial.motion, trial.contacts
        assert contacts is not None
        during = None
        if known.seconds is not None:
            first, last = (round(second * motion.rate) for second in known.seconds)
            during = first, min(last, motion.frames)
        yield Example(
            known.source,
            f"{known.folder} {known.trial}",
            known.activity,
            known.kind,
            skeleton,
            contacts.foot_bodies,
            motion,
            load_of(contacts, mass),
            during=during,
        )


class _TrackedError(Exception):
    """The markers are fitted: forces are not asked for."""

    def __init__(self, skeleton: Skeleton, trials: Sequence[TrialFit]) -> None:
        super().__init__()
        self.skeleton, self.trials = skeleton, trials


def _tracked(folder: str, trials: Sequence[str]) -> dict[str, tuple[Skeleton, TrialFit, float]]:
    """The motion of the markers, and loads by foot; the fit ends there, since suggestions need no more."""
    subject = open_subject(data_folder() / folder)
    if STATIC in trials:
        assert subject.static is not None
        subject = replace(subject, trials=(*subject.trials, TrialFiles(STATIC, subject.static)))

    def ends(
        _subject: Subject, groundwork: object, fits: Sequence[TrialFit], *_: object, **__: object
    ) -> Fit:
        raise _TrackedError(groundwork.skeleton, fits)  # type: ignore[attr-defined]

    with patch.object(pipeline, "apply_reviews", ends):
        try:
            pipeline.solve(subject, settings_for(subject.folder), trials=trials)
        except _TrackedError as found:
            mass = subject.mass_kg or found.skeleton.mass
            return {trial.capture.name: (found.skeleton, trial, mass) for trial in found.trials}
    raise AssertionError
