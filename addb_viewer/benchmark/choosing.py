"""One of several like predictors, chosen for each person and activity by how they do on the other persons."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from addb_viewer.benchmark.averages import by_person
from addb_viewer.benchmark.results import Result
from addb_viewer.benchmark.scoring import Score


def chosen_by_others(results: Sequence[Result], name: str, metric: str) -> Result:
    """Their scores as one result: nobody's own error has a say in what is chosen for them.

    Where nobody else has the activity, others' errors in all activities choose; where there is nobody else,
    the first of the predictors stands.

    Args:
        results: of like predictors on the same frames.
        name: of what is made of them.
        metric: whose smallest mean over persons is chosen.
    """
    activities = sorted({score.activity for score in results[0].scores})
    errors = {
        activity: [by_person(one.scores, metric, activity) for one in results]
        for activity in (None, *activities)
    }
    scores: list[Score] = []
    for person in sorted({score.person_id for score in results[0].scores}):
        for activity in activities:
            best = _best(errors[activity], person)
            best = _best(errors[None], person) if best is None else best
            scores += [
                score
                for score in results[best or 0].scores
                if score.person_id == person and score.activity == activity
            ]
    return replace(results[0], name=name, scores=tuple(scores), seconds=sum(one.seconds for one in results))


def _best(errors: Sequence[dict[str, float]], person: str) -> int | None:
    """Place of the predictor that is best on others; None where there are none."""
    means = [
        np.mean([value for other, value in own.items() if other != person] or [np.nan]) for own in errors
    ]
    return None if np.isnan(means).any() else int(np.argmin(means))
