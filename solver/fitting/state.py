"""What is known of a fit so far: the state that each stage of the pipeline hands on to the next."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool

from solver.capture.capture import Capture, Subject
from solver.common.notes import Note
from solver.contact.force_review import ForceReview
from solver.dynamics.force_prediction.learnt_terms import LearntTerms
from solver.dynamics.force_prediction.prediction_fit import Predicted
from solver.dynamics.person_estimates import PersonMass
from solver.dynamics.trajectory.extension import Extension
from solver.dynamics.trajectory.near_edits import InertiasBefore
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit
from solver.dynamics.trajectory.trial_data import TrialData
from solver.fitting.fit_result import Groundwork, SettledFit, TrialFit
from solver.kinematics.kept_calibration import KeptCalibration
from solver.kinematics.label_faults.fault import LabelFault
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

Stretches = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Recordings:
    """What the files hold."""

    generic: Skeleton  # the subject's model or ours, unscaled
    captures: tuple[Capture, ...]
    static: Capture | None
    landmarks: Mapping[str, str]  # of the atlas, by label
    label_faults: tuple[tuple[LabelFault, ...], ...] = ()  # by capture, repaired in it

    @property
    def shown(self) -> tuple[Capture, ...]:
        """All of them, the static one last."""
        return (*self.captures, *((self.static,) if self.static else ()))


@dataclass(frozen=True)
class Person:
    """How tall and heavy, measured or estimated."""

    height_m: float  # NaN where nothing tells it
    height_notes: tuple[Note, ...]
    mass: PersonMass


@dataclass(frozen=True)
class MassAndGains:
    """What plates say of one body."""

    mass_kg: float
    gains: tuple[float, ...]  # by trial: that its forces are divided by
    notes: tuple[Note, ...] = ()
    std_kg: float = 0.0  # how far the mass may be off


@dataclass(frozen=True)
class Edit:
    """What changed since the former fit, where that is little."""

    edited: tuple[Bool[np.ndarray, " frames"], ...]  # by trial
    weighed: MassAndGains  # as the former fit took it
    settled: SettledFit
    inertias: InertiasBefore
    learnt: LearntTerms | None  # None: nothing was predicted
    kinds: tuple[str, ...] | None  # of learnt terms, where a first prediction fit is to be made
    untouched: frozenset[str] = frozenset()  # trials that come out as they were, but for the body's mass

    @property
    def is_first_to_predict(self) -> bool:
        """Whether a first prediction fit is to be made, which learns from all trials."""
        return self.learnt is None and self.kinds is not None


@dataclass(frozen=True)
class KeptModel:
    """A person's model, and what it was made for."""

    calibration: KeptCalibration
    made_for: tuple[object, ...]  # description, files that trials share, markers, settings


@dataclass
class Session:
    """A person's model from one solve to the next, each of a further trial."""

    former: KeptModel | None = None  # None: nothing was solved
    next: KeptModel | None = None  # as this solve leaves it


@dataclass(frozen=True)
class FitState:
    """Inputs, and what the stages so far have found; `solver/fitting/pipeline.py` says in which order."""

    subject: Subject
    groundwork: Groundwork  # its skeleton scaled once that is done; of a re-solve, the former fit's
    skeleton: Skeleton  # that of the groundwork, once known with the person's mass
    reviews: Mapping[str, ForceReview] = field(default_factory=dict)  # by trial
    extension: Extension | None = None  # what acts beside the recorded forces
    session: Session | None = None  # None: the model is scaled to these trials alone
    read: Recordings | None = None  # None in a re-solve, which has the marker fits of the former solve
    seconds: Mapping[str, float] = field(default_factory=dict)  # CPU, by stage, of all trials together
    trials: tuple[TrialFit, ...] = ()
    former: tuple[TrialFit, ...] = ()  # of a re-solve, those of the fit that it begins with
    whole: tuple[TrialFit, ...] = ()  # their marker fits, where `trials` are the parts that show a person
    reviews_of_parts: Mapping[str, ForceReview] = field(default_factory=dict)  # likewise of these parts
    person: Person | None = None
    detected_mass_kg: float | None = None  # that missing forces were detected with
    detected_without: tuple[Stretches, ...] = ()  # by trial, erroneous stretches left out of it
    fitted: tuple[int, ...] = ()  # which trials have forces enough for a trajectory fit
    weighed: MassAndGains | None = None  # by the plates of these
    edit: Edit | None = None  # None: all frames are asked
    data: tuple[TrialData, ...] = ()  # of these
    motion_only: TrajectoryFit | None = None  # the fit that a first prediction fit begins with
    prediction: Predicted | None = None  # None: no force is missing
    result: TrajectoryFit | None = None
    notes: tuple[Note, ...] = ()  # on the trajectories, the masses and what is learnt
    settled: SettledFit | None = None  # what the next re-solve goes by
    learnt_on: Mapping[str, Stretches] = field(default_factory=dict)
    # by trial, the stretches of known frames that chose the kinds of learnt terms

    @property
    def recordings(self) -> Recordings:
        """Of a solve that began with files."""
        assert self.read is not None
        return self.read

    @property
    def members(self) -> list[TrialFit]:
        """The trials that are fitted to forces."""
        return [self.trials[i] for i in self.fitted]

    @property
    def weighed_skeleton(self) -> Skeleton:
        """With the mass that the trials' plates agree on; trajectories are fitted with it."""
        return with_mass(self.skeleton, self.weighed.mass_kg) if self.weighed else self.skeleton

    @property
    def fitted_skeleton(self) -> Skeleton:
        """With fitted inertias, where trajectories were fitted."""
        return self.result.skeleton if self.result else self.skeleton
