"""Recorded labels and the model's markers: who is who, by names, by the atlas, and by a person's word."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from solver.capture.capture import Markers
from solver.errors import FitError
from solver.kinematics.bare_model import is_bare
from solver.kinematics.default_body_naming import NamedMarkers, on_default_body
from solver.kinematics.marker_matching import match_markers
from solver.kinematics.own_model_naming import in_own_model
from solver.markers.atlas import atlas
from solver.markers.understanding import understand
from solver.skeleton.skeleton import Skeleton


def name_markers(
    generic: Skeleton,
    recordings: Sequence[Markers],
    *,
    default_body: bool,
    chosen: Mapping[str, str] | None = None,
) -> NamedMarkers:
    """Pair the recordings' labels with the model's markers; the default body gets those it lacks.

    Args:
        generic: unscaled.
        recordings: of one subject.
        default_body: whether `generic` is ours, so that the atlas knows its landmarks; a model of the
            subject's own keeps its markers, and gets others only where these are too few.
        chosen: a person's word: label to landmark or marker of the model, "" to leave the label out.

    Raises:
        FitError: too few markers are shared, or `chosen` names what neither atlas nor model has.
    """
    word = _checked(chosen or {}, generic, default_body)
    if not default_body:
        generic, named, notes = in_own_model(generic, recordings, word)
        try:
            return NamedMarkers(generic, match_markers(generic, recordings, named=named, notes=notes))
        except FitError as error:
            raise FitError(f"{error} Without any model it is fitted on the default body.") from error
    return on_default_body(generic, recordings, word)


def _checked(chosen: Mapping[str, str], generic: Skeleton, default_body: bool) -> dict[str, str]:
    """A person's word, in which landmarks of a subject's own model are replaced by its markers."""
    word = {}
    by_landmark = default_body or is_bare(generic)
    of_marker = {} if default_body else _markers_by_landmark(generic)
    for label, target in chosen.items():
        if target in ("", *generic.marker_names) or (by_landmark and target in atlas()):
            word[label] = target
        elif target in of_marker:
            word[label] = of_marker[target]
        else:
            raise FitError(_unknown(label, target, generic, by_landmark))
    return word


def _unknown(label: str, target: str, generic: Skeleton, by_landmark: bool) -> str:
    names = [*generic.marker_names, *(atlas() if by_landmark else ())]
    near = get_close_matches(target, names, n=2)
    like = f" Nearest: {', '.join(near)}." if near else ""
    return (
        f"The marker map says {label} = '{target}', neither a landmark nor a marker of '{generic.name}'."
        f"{like} `addb-viewer markers --landmarks` lists the landmarks; '' leaves the label out."
    )


def _markers_by_landmark(generic: Skeleton) -> dict[str, str]:
    rows = understand(generic.marker_names).labels
    return {r.landmark: r.label for r in rows if r.used and r.landmark is not None}
