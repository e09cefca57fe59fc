"""How the line between the pelvic spines is inclined in the pelvis: upright posture has a say.

Nothing that markers on the pelvis do tells how the bone is pitched against them. By the usual places alone, a
person whose spines' markers sit high in front would stand with the pelvis tipped over backwards. Both that
inclination and the posture of people who stand, walk and run vary; each takes its share of what is unusual.
Where a model has a marker of the pelvis or the trunk elsewhere than it was worn, the whole walk leans, and
hips and back make up for it: a mean posture that people do not walk in is told.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.common.notes import Kind, Note, noted
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.motion import Motion
from solver.markers.atlas import atlas, place_on
from solver.skeleton.skeleton import Skeleton

# [°] mean pelvis tilt of a walk, negative forwards: experts' fits have −2° to 5°, and models differ in how
# their pelvis stands; a chosen margin about these, from no published range
LEAST_WALKING_TILT_DEG = -25.0
MOST_WALKING_TILT_DEG = 12.0  # [°] likewise backwards: by as much again as experts' fits vary
# [°] mean lumbar extension of a walk, negative bent forwards: experts' fits have −19° to −3°
LEAST_WALKING_LUMBAR_DEG = -28.0
MOST_WALKING_LUMBAR_DEG = 15.0  # [°] likewise bent backwards

# Between people, the line of the spines lies in the bone within 5° (0° to 23° in 30 pelves:
# Preece et al., J Man Manip Ther 2008; 16: 113-117); 1.2 cm of palpation over its 15 cm are another 4.6°.
INCLINATION_VARIANCE_DEG2 = 5.0**2 + 4.6**2
# People stand within 5° of each other (Levine & Whittle 1996), and lean further where they walk and run.
POSTURE_VARIANCE_DEG2 = 10.0**2
# Some laboratories put these markers elsewhere on the pelvis altogether. So the bone's distribution has the
# tails of Student's t, and posture, which people's joints bound, those of a Gaussian.
TAIL_DEGREES_OF_FREEDOM = 3.0  # degrees of freedom
UPRIGHT_M = 0.03  # below the highest the pelvis gets; lower down the person squats or sits
HIGHEST = 95.0  # percentile that counts for "the highest": a jump is short
NOTABLE_DEG = 0.1  # nearer to the usual inclination, the markers stay as they are
SHARES = 1001  # ways to share, evenly: a thousandth of what is unusual is nothing
FURTHEST_DEG = 45.0  # from the usual inclination; further off, nobody is upright
FRONT = (("asis_r", "asis_l"), ("asis_r",), ("asis_l",))
BACK = (("psis_r", "psis_l"), ("sacrum",), ("psis_r",), ("psis_l",))
HIPS = ("hip_flexion_r", "hip_flexion_l")
STRIDE_S = 0.8  # shorter recordings show no whole step of each leg
STRIDE_DEG = 20.0  # of hip flexion, which people who walk exceed
ALTERNATES = -0.5  # correlation of the two hips below which the legs take turns


def on_upright_pelvis(skeleton: Skeleton, match: MarkerMatch, recordings: Sequence[Markers]) -> Skeleton:
    """The skeleton with the spines' markers turned in the pelvis by the bone's share of what is unusual.

    Args:
        skeleton: the default body.
        match: which label is which marker.
        recordings: of one subject, y up.
    """
    marked = at_landmarks(skeleton, match, {name for names in (*FRONT, *BACK) for name in names})
    front, back = _complete(FRONT, marked), _complete(BACK, marked)
    if not front or not back:
        return skeleton
    place = {marker.name: marker.position_body for marker in skeleton.markers}
    usual_front = np.mean([place[name] for name in front], axis=0)
    usual_back = np.mean([place[name] for name in back], axis=0)
    seen = [match.observed(r) for r in recordings]
    ends = [
        np.concatenate([s[:, [match.model.index(name) for name in names]].mean(axis=1) for s in seen])
        for names in (front, back)
    ]
    shown = upright_inclination(*ends)
    unusual = shown - float(_inclination(usual_front, usual_back))
    along, _, aside = usual_front - usual_back
    unusual *= np.hypot(along, aside) / abs(along)  # one spine of a pair: the line runs aslant
    if not np.radians(NOTABLE_DEG) < abs(unusual) < np.radians(FURTHEST_DEG):
        return skeleton
    turn = -np.radians(of_bone(float(np.degrees(unusual))))
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    middle = (usual_front + usual_back) / 2
    turned = {name: middle + R @ (place[name] - middle) for name in marked.values()}
    return skeleton.with_markers(
        [replace(m, position_body=turned[m.name]) if m.name in turned else m for m in skeleton.markers]
    )


def upright_inclination(
    front_ground: Float[np.ndarray, "frames 3"], back_ground: Float[np.ndarray, "frames 3"]
) -> float:
    """Median inclination of the spines' line against the ground in upright posture [rad].

    Args:
        front_ground: middle of the anterior spines [m], y up, NaN where unseen.
        back_ground: middle of the posterior ones [m].

    Returns:
        Positive where the front is the lower; NaN where the spines are never seen together.
    """
    together = np.isfinite(front_ground + back_ground).all(axis=1)
    if not together.any():
        return float("nan")
    front, back = front_ground[together], back_ground[together]
    height = (front[:, 1] + back[:, 1]) / 2
    upright = height > np.percentile(height, HIGHEST) - UPRIGHT_M
    return float(np.median(_inclination(front[upright], back[upright])))


def pitch_of_spines(
    skeleton: Skeleton, landmarks: Mapping[str, str]
) -> Float[np.ndarray, "markers 3"] | None:
    """How much the line of the spines turns in the pelvis as their markers move [rad/m]; None without a line.

    Args:
        skeleton: the default body with the recordings' markers.
        landmarks: marker at each landmark that is known.
    """
    front, back = _complete(FRONT, landmarks), _complete(BACK, landmarks)
    if not front or not back:
        return None
    index = {marker.name: i for i, marker in enumerate(skeleton.markers)}
    place = np.array([marker.position_body for marker in skeleton.markers])
    ends = [place[[index[name] for name in names]].mean(axis=0) for names in (front, back)]
    x, y, _ = ends[0] - ends[1]
    across = np.array([-y, x, 0.0]) / (x**2 + y**2)
    pitch = np.zeros((len(skeleton.markers), 3))
    for names, sign in ((front, 1.0), (back, -1.0)):
        for name in names:
            pitch[index[name]] += sign * across / len(names)
    return pitch


def of_bone(unusual_deg: float) -> float:
    """What the bone, or where its markers sit, takes of an unusual inclination [°]; posture has the rest.

    The likelier of all ways to share it: Student's t for the bone, a Gaussian for posture.
    """

    def unlikely(bone: float) -> float:
        statistics = (TAIL_DEGREES_OF_FREEDOM + 1) * np.log1p(
            bone**2 / (TAIL_DEGREES_OF_FREEDOM * INCLINATION_VARIANCE_DEG2)
        )
        return float(statistics + (unusual_deg - bone) ** 2 / POSTURE_VARIANCE_DEG2)

    shares = np.linspace(0.0, unusual_deg, SHARES)
    return float(shares[np.argmin([unlikely(share) for share in shares])])


def _inclination(
    front: Float[np.ndarray, "*frames 3"], back: Float[np.ndarray, "*frames 3"]
) -> Float[np.ndarray, " *frames"]:
    apart = front - back
    return np.arctan2(-apart[..., 1], np.hypot(apart[..., 0], apart[..., 2]))


def at_landmarks(skeleton: Skeleton, match: MarkerMatch, landmarks: Iterable[str]) -> dict[str, str]:
    """Landmark to marker, of those that the recordings share and that sit at one of the given landmarks.

    Args:
        skeleton: the default body.
        match: which label is which marker.
        landmarks: of the atlas.
    """
    found = {}
    for landmark in landmarks:
        mark = atlas()[landmark]
        body, there = skeleton.body_index(mark.body), place_on(mark, skeleton)
        for marker in skeleton.markers:
            if (
                marker.name in match.model
                and marker.body == body
                and np.allclose(marker.position_body, there)
            ):
                found[landmark] = marker.name
    return found


def _complete(choices: Sequence[Sequence[str]], marked: Mapping[str, str]) -> list[str]:
    """The markers of the first choice of landmarks that is there as a whole."""
    for names in choices:
        if all(name in marked for name in names):
            return [marked[name] for name in names]
    return []


def posture_notes(motion: Motion) -> tuple[Note, ...]:
    """Warnings of a walk or run whose mean pelvis tilt or lumbar extension people do not have.

    Args:
        motion: by the markers, with OpenSim's names of coordinates.
    """
    if not walks(motion):
        return ()
    notes: list[Note] = []
    for name, what, least, most in (
        ("pelvis_tilt", "pelvis tilt", LEAST_WALKING_TILT_DEG, MOST_WALKING_TILT_DEG),
        ("lumbar_extension", "lumbar extension", LEAST_WALKING_LUMBAR_DEG, MOST_WALKING_LUMBAR_DEG),
    ):
        if name in motion.dofs:
            mean = float(np.degrees(motion.q[:, motion.dofs.index(name)].mean()))
            if not least <= mean <= most:
                notes += noted(
                    Kind.MODEL_AGAINST_MARKERS,
                    f"mean {what} is {mean:.0f}°, and people walk with {least:.0f}° to {most:.0f}°: are the "
                    "model's markers of pelvis and trunk where they were worn? Angles of hips and back are "
                    "off by as much",
                )
    return tuple(notes)


def walks(motion: Motion) -> bool:
    """Whether the legs take turns in strides."""
    if motion.frames < STRIDE_S * motion.rate or not all(hip in motion.dofs for hip in HIPS):
        return False
    right, left = (np.degrees(motion.q[:, motion.dofs.index(hip)]) for hip in HIPS)
    if min(np.ptp(right), np.ptp(left)) < STRIDE_DEG:
        return False
    return bool(np.corrcoef(right, left)[0, 1] < ALTERNATES)
