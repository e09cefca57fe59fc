"""What the labels of a fit's recording mean: by the fit's model, and by the atlas."""

from collections.abc import Sequence

from solver.fitting.fit import Fit
from solver.markers.atlas import atlas
from solver.markers.understanding import UnderstoodLabel, understand


def understood_labels(fit: Fit) -> tuple[UnderstoodLabel, ...]:
    """The labels of the first trial as the atlas understands them, the fit's model unseen."""
    markers = fit.trials[0].capture.markers
    return understand(markers.names, [markers]).labels


def bodies_of_labels(fit: Fit) -> dict[str, str]:
    """The body of the fit's model that each of its labels is on."""
    assert fit.groundwork is not None
    skeleton, match = fit.groundwork.skeleton, fit.groundwork.match
    body = {marker.name: skeleton.bodies[marker.body].name for marker in skeleton.markers}
    return {
        label: body[name]
        for name, labels in zip(match.model, match.measured, strict=True)
        for label in labels
    }


def raw_columns(fit: Fit, rows: Sequence[UnderstoodLabel]) -> dict[str, list[int]]:
    """Per body, the columns of the first trial that the fit has on it; computed joint centres left out.

    Args:
        fit: whose model says what is on which body.
        rows: its labels as the atlas understands them.
    """
    body = bodies_of_labels(fit)
    computed = {r.label for r in rows if r.landmark is not None and atlas()[r.landmark].kind == "centre"}
    found: dict[str, list[int]] = {name: [] for name in fit.skeleton.body_names}
    for column, label in enumerate(fit.trials[0].capture.markers.names):
        if label in body and label not in computed:
            found[body[label]].append(column)
    return found
