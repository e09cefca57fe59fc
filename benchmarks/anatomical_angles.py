"""Joint angles with the segments' axes laid through anatomical landmarks, not along a model's bone frames.

Where two models pitch the pelvis differently in its bone, their hip angles differ by that constant whatever
the person does. Clinical angles have no such constant: the pelvis' axis comes from its spines (as the ISB
recommends: Wu et al., J Biomech 2002; 35: 543-548), the foot's from the heel to the heads of the metatarsals
(Leardini et al., Gait Posture 2007; 25: 453-462), thigh's and shank's from the fit's joint centres. Two fits
that follow the same markers agree about the first two: what is compared is where thigh and shank lie to them.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from benchmarks.leg_joints import JOINTS
from solver.fitting.fit import Fit

FRONT_OF_FOOT = ("mt1_head", "mt2_head", "mt5_head")
Points = Mapping[str, Float[np.ndarray, "frames 3"]]  # landmark to its places on the fitted skeleton [m]


def landmark_places(fit: Fit, labels: Mapping[str, str]) -> dict[str, Float[np.ndarray, "frames 3"]]:
    """Where the fitted skeleton has the markers of these landmarks, in the ground frame [m].

    Args:
        fit: its first trial counts.
        labels: landmark to label; those that the fit does not use are left out.
    """
    assert fit.groundwork is not None
    column = {label: i for i, names in enumerate(fit.groundwork.match.measured) for label in names}
    places = fit.trials[0].model_markers_ground
    return {mark: places[:, column[label]] for mark, label in labels.items() if label in column}


def anatomical_angles(
    marks: Points, centres: Points, side: str
) -> dict[str, Float[np.ndarray, " frames"] | None]:
    """Angles of hip, knee and ankle in the pelvis' sagittal plane [rad]; None where landmarks are missing.

    From the pelvis' forward axis to the thigh, from the thigh to the shank, from the shank to the foot; all
    grow as the segment behind swings forwards.

    Args:
        marks: of pelvis and feet.
        centres: hip, knee and ankle of this side.
        side: "r" or "l".
    """
    thigh, shank = centres["knee"] - centres["hip"], centres["ankle"] - centres["knee"]
    if not {"asis_r", "asis_l"} <= marks.keys():
        return dict.fromkeys(JOINTS)
    right = _unit(marks["asis_r"] - marks["asis_l"])
    forwards, foot = _forwards(marks, right), _foot(marks, side)
    return {
        "hip": None if forwards is None else _angle(forwards, thigh, right),
        "knee": _angle(thigh, shank, right),
        "ankle": None if foot is None else _angle(shank, foot, right),
    }


def _forwards(marks: Points, right: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "frames 3"] | None:
    """From the posterior spines, or the sacrum, to the anterior ones; across the way to the right."""
    choices = (("psis_r", "psis_l"), ("sacrum",))
    back = next(([marks[m] for m in names] for names in choices if marks.keys() >= set(names)), None)
    front = (marks["asis_r"] + marks["asis_l"]) / 2
    return _across(front - np.mean(back, axis=0), right) if back is not None else None


def _foot(marks: Points, side: str) -> Float[np.ndarray, "frames 3"] | None:
    """From the heel to the heads of the metatarsals."""
    front = [marks[f"{name}_{side}"] for name in FRONT_OF_FOOT if f"{name}_{side}" in marks]
    heel = marks.get(f"heel_{side}")
    return np.mean(front, axis=0) - heel if front and heel is not None else None


def _angle(
    start: Float[np.ndarray, "frames 3"],
    end: Float[np.ndarray, "frames 3"],
    axis: Float[np.ndarray, "frames 3"],
) -> Float[np.ndarray, " frames"]:
    """From one direction to the other about an axis, both seen along it [rad]."""
    a, b = _across(start, axis), _across(end, axis)
    return np.arctan2((np.cross(a, b) * axis).sum(axis=1), (a * b).sum(axis=1))


def _across(v: Float[np.ndarray, "frames 3"], axis: Float[np.ndarray, "frames 3"]) -> np.ndarray:
    """The unit vector of what is perpendicular to the axis."""
    return _unit(v - (v * axis).sum(axis=1, keepdims=True) * axis)


def _unit(v: Float[np.ndarray, "frames 3"]) -> np.ndarray:
    return v / np.linalg.norm(v, axis=1, keepdims=True)
