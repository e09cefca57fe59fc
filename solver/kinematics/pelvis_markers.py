"""At which spines of the pelvis the fit has markers: what holds the pelvis where some are missing is said."""

from collections.abc import Collection

from solver.common.notes import Kind, Note, noted
from solver.kinematics.marker_matching import MarkerMatch
from solver.markers.understanding import understand
from solver.skeleton.skeleton import Skeleton

SPINES = {
    "asis_r": "right anterior spine (ASIS)",
    "asis_l": "left anterior spine (ASIS)",
    "psis_r": "right posterior spine (PSIS)",
    "psis_l": "left posterior spine (PSIS)",
}


def pelvis_notes(skeleton: Skeleton, match: MarkerMatch, known: Collection[str] = ()) -> tuple[Note, ...]:
    """A note where a spine of the pelvis has no marker; the sacrum stands for both posterior ones.

    Args:
        skeleton: with the model's markers.
        match: which label is which marker.
        known: landmarks that markers sit at though no name tells.
    """
    root = [body for body, joint in enumerate(skeleton.joints) if joint.parent < 0]
    body_of = {marker.name: marker.body for marker in skeleton.markers}
    on_pelvis = [i for i, name in enumerate(match.model) if body_of[name] in root]
    names = [name for i in on_pelvis for name in (match.model[i], *match.measured[i])]
    named = {row.landmark for row in understand(names).labels if row.landmark is not None}
    here = named | set(known)
    missing = [spine for spine in SPINES if spine not in here]
    if "sacrum" in here and not {"psis_r", "psis_l"} & here:
        missing = [spine for spine in missing if not spine.startswith("psis")]
    if not missing:
        return ()
    where = ", ".join(SPINES[spine] for spine in missing)
    held = ", ".join(match.measured[i][0] for i in on_pelvis) or "no marker of its own"
    by_how_much = "its angles and the hips' may be off by some degrees"
    if {"asis_r", "asis_l"} <= set(missing) or {"psis_r", "psis_l"} <= set(missing):
        by_how_much = "only legs and trunk tell its tilt: it, and the hips' flexion, may be off by 15°"
    return noted(Kind.PELVIS, f"no marker at the {where}: the pelvis is held by {held}, and {by_how_much}")


def landmarks_by_name(match: MarkerMatch) -> dict[str, str]:
    """The model's marker at each landmark that its name, or a label's, tells.

    Args:
        match: which label is which marker.
    """
    marker_of = {
        name: model
        for model, labels in zip(match.model, match.measured, strict=True)
        for name in (model, *labels)
    }
    found: dict[str, str] = {}
    for row in understand(list(marker_of)).labels:
        if row.landmark is not None:
            found.setdefault(row.landmark, marker_of[row.label])
    return found
