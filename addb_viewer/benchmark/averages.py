"""Means over frames, trials and persons, with intervals over persons, and tests of two predictors."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from addb_viewer.benchmark.scoring import PHASES, Score

DRAWS, SEED = 10_000, 0  # of persons, for intervals and for tests where signs are too many to be counted out
FEWEST_PERSONS = 5  # for an interval
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Average:
    """One figure of one predictor."""

    mean: float  # over persons of their means over trials of the means over frames
    low: float | None  # ends of the interval; None: too few persons
    high: float | None
    over_frames: float
    over_trials: float
    over_activities: float  # of the means over persons within each activity
    persons: int
    trials: int
    frames: int


@dataclass(frozen=True)
class Comparison:
    """Whether one predictor's errors differ from another's, person by person."""

    first: str
    second: str
    difference: float  # second − first, mean over persons that both were tested on
    persons: int
    p: float  # two-sided, before the correction
    p_holm: float


def by_trial(
    scores: Iterable[Score], metric: str, activity: str | None = None
) -> dict[tuple[str, str], "Sum"]:
    """Each person's trials: the figure's sum over frames.

    Args:
        scores: of one predictor.
        metric: which.
        activity: only its frames; None: all.
    """
    found: dict[tuple[str, str], Sum] = defaultdict(Sum)
    for score in scores:
        if score.metric == metric and activity in (None, score.activity):
            key = (score.person_id, score.trial_id)
            found[key] = found[key].plus(score.mean, score.frames)
    return dict(found)


@dataclass(frozen=True)
class Sum:
    """Of a figure over frames."""

    total: float = 0.0
    frames: int = 0

    def plus(self, mean: float, frames: int) -> "Sum":
        """With some more frames.

        Args:
            mean: over them.
            frames: how many.
        """
        return Sum(self.total + mean * frames, self.frames + frames)

    @property
    def mean(self) -> float:
        """Over the frames."""
        return self.total / self.frames


def by_person(scores: Iterable[Score], metric: str, activity: str | None = None) -> dict[str, float]:
    """Each person's mean over trials of the trials' means over frames.

    Args:
        scores: of one predictor.
        metric: which.
        activity: only its frames; None: all.
    """
    trials: dict[str, list[float]] = defaultdict(list)
    for (person, _), total in sorted(by_trial(scores, metric, activity).items()):
        trials[person].append(total.mean)
    return {person: float(np.mean(values)) for person, values in trials.items()}


def average(scores: Sequence[Score], metric: str, activity: str | None = None) -> Average | None:
    """The figure over persons; None where no frame has it.

    Args:
        scores: of one predictor.
        metric: which.
        activity: only its frames; None: all.
    """
    trials = by_trial(scores, metric, activity)
    if not trials:
        return None
    persons = by_person(scores, metric, activity)
    values = np.array(list(persons.values()))
    low, high = interval(values)
    frames = sum(total.frames for total in trials.values())
    activities = {score.activity for score in scores if activity in (None, score.activity)}
    of_activities = [by_person(scores, metric, one) for one in sorted(activities)]
    return Average(
        mean=float(values.mean()),
        low=low,
        high=high,
        over_frames=sum(total.total for total in trials.values()) / frames,
        over_trials=float(np.mean([total.mean for total in trials.values()])),
        over_activities=float(np.mean([np.mean(list(one.values())) for one in of_activities if one])),
        persons=len(values),
        trials=len(trials),
        frames=frames,
    )


def interval(values: Float[np.ndarray, " persons"]) -> tuple[float | None, float | None]:
    """95 % interval of the mean: percentiles of means of persons drawn anew; none below five persons.

    Args:
        values: one a person.
    """
    from scipy.stats import bootstrap  # noqa: PLC0415 (slow to load)

    if len(values) < FEWEST_PERSONS:
        return None, None
    if np.ptp(values) == 0:
        return float(values[0]), float(values[0])
    drawn = bootstrap(
        (values,),
        np.mean,
        n_resamples=DRAWS,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(SEED),
    )
    return float(drawn.confidence_interval.low), float(drawn.confidence_interval.high)


def compared(
    first: str, others: Mapping[str, Mapping[str, float]], own: Mapping[str, float]
) -> list[Comparison]:
    """A predictor against others: signs of the persons' differences are flipped; p by Holm's correction.

    Args:
        first: its name.
        others: their values by person.
        own: its values by person.
    """
    found = []
    for name, values in others.items():
        shared = sorted(set(values) & set(own))
        differences = np.array([values[person] - own[person] for person in shared])
        if len(differences):
            found.append((name, float(differences.mean()), len(shared), sign_flip(differences)))
    corrected = holm([p for *_, p in found])
    return [
        Comparison(first, name, difference, persons, p, corrected[k])
        for k, (name, difference, persons, p) in enumerate(found)
    ]


def sign_flip(differences: Float[np.ndarray, " persons"]) -> float:
    """Two-sided p of the mean being zero where each person's sign might as well be the other.

    Args:
        differences: one a person.
    """
    from scipy.stats import permutation_test  # noqa: PLC0415 (slow to load)

    if len(differences) < 2 or not differences.any():
        return 1.0
    test = permutation_test(
        (differences,),
        np.mean,
        permutation_type="samples",
        n_resamples=DRAWS,
        rng=np.random.default_rng(SEED),
    )
    return float(test.pvalue)


def holm(p: Sequence[float]) -> list[float]:
    """Values of p corrected for their number, step by step from the smallest."""
    corrected, so_far = [1.0] * len(p), 0.0
    for step, k in enumerate(np.argsort(p, kind="stable")):
        so_far = max(so_far, min(1.0, (len(p) - step) * p[k]))
        corrected[k] = so_far
    return corrected


def macro_f1(scores: Iterable[Score]) -> float | None:
    """Mean of the phases' F1 over all frames; of phases that occur. None where no phase is known.

    Args:
        scores: of one predictor.
    """
    counts = np.zeros((len(PHASES), len(PHASES)))
    for score in scores:
        if score.metric.startswith("phase:"):
            true, told = (int(one) for one in score.metric.removeprefix("phase:").split(">"))
            counts[true, told] += score.mean * score.frames
    there = counts.sum(axis=1) > 0
    if not there.any():
        return None
    both = counts.sum(axis=1) + counts.sum(axis=0)
    return float(np.mean(2 * np.diag(counts)[there] / both[there]))
