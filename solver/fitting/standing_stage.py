"""The person on the scales: what all plates together read while somebody stands still on them."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Capture, ForcePlate, Subject, TrialFiles
from solver.capture.plates.conditioning import condition
from solver.capture.subject.statics import shown_by
from solver.capture.trial import read_trial
from solver.common.errors import SolverError
from solver.contact.needed_segments import UPRIGHT, hips_over_ankles
from solver.contact.sole import independent_feet, soles
from solver.dynamics.com_mass import MassEstimate, Standing
from solver.dynamics.mass import LIGHTEST_KG
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.fitting.settings import Settings
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.marker_matching import MarkerMatch
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

POSES = 12  # of somebody who stands still
SHORTEST_S = 0.5
STEADY = 0.1  # of the weight: how far it spreads over four fifths of the time; who sways keeps within 5 %
UNDER_M = 0.05  # from below the centre of mass to where it presses: within 2.7 cm there; one of two feet, 10
PRESSED = 0.75  # of a sole's length and width, about its pieces' middles: pressure spares the rim
RIM_M = 0.03  # by which soles of the model may be misplaced over a plate's edge


def weighed_standing(
    subject: Subject,
    trials: Sequence[Capture],
    static: Capture | None,
    *,
    skeleton: Skeleton,
    match: MarkerMatch,
    settings: Settings,
) -> tuple[Standing, ...]:
    """Whoever stands still, upright, with the whole weight on plates; asked where nobody entered a mass.

    Either both soles are over plates that carry something, or the plates together press where the centre of
    mass is: of a foot on the floor beside them its force would be missing.

    Args:
        subject: whose.
        trials: as recorded.
        static: likewise; its plates are read from its own file.
        skeleton: scaled, with the markers of the match.
        match: markers of the recordings.
        settings: of every stage.
    """
    if subject.mass_kg is not None:
        return ()
    found = []
    for capture in (*_with_plates(subject, static, settings), *trials):
        what = shown_by(capture.markers)
        if not capture.plates or not what.is_still or what.seconds < SHORTEST_S:
            continue
        try:
            mass = _weight_of(capture, skeleton, match, subject.foot_bodies, settings)
        except SolverError:  # too few markers for a pose, or a model without feet
            continue
        if mass is not None:
            found.append(Standing(capture.name, mass))
    return tuple(found)


def _with_plates(subject: Subject, static: Capture | None, settings: Settings) -> tuple[Capture, ...]:
    """The static trial with the forces that its own file holds, where they can be read."""
    if static is None or subject.static is None:
        return ()
    try:
        return (read_trial(TrialFiles(static.name, subject.static, prefix=subject.prefix), settings.reading),)
    except SolverError:
        return ()


def _weight_of(
    capture: Capture, skeleton: Skeleton, match: MarkerMatch, foot_bodies: Sequence[str], settings: Settings
) -> MassEstimate | None:
    markers, g = capture.markers, float(np.linalg.norm(skeleton.gravity))
    plates = [condition(plate, markers.times, settings.conditioning) for plate in capture.plates]
    known = np.all([plate.observed for plate in plates], axis=0)
    if known.sum() < SHORTEST_S * markers.rate:
        return None
    up = sum(plate.force_ground[known, 1] for plate in plates)
    low, weight, high = np.percentile(up, [10, 50, 90])
    if weight < LIGHTEST_KG * g or high - low > STEADY * weight:
        return None
    some = np.unique(np.linspace(0, markers.frames - 1, POSES).round().astype(int))
    rate = markers.rate * len(some) / markers.frames
    q = inverse_kinematics(skeleton, match.observed(markers)[some], rate, settings.kinematics)
    q = q[np.isfinite(q).all(axis=1)]
    upright = hips_over_ankles(skeleton, q)
    if upright is None or np.median(upright) < UPRIGHT:
        return None
    force, moment = (
        np.median(sum(getattr(plate, name)[known] for plate in plates), axis=0)
        for name in ("force_ground", "moment_ground")
    )
    pressed = np.array([moment[2], -moment[0]]) / force[1]
    below_com = np.median(centre_of_mass_of(skeleton, q), axis=0)[[0, 2]]
    loaded = [
        plate
        for plate, read in zip(capture.plates, plates, strict=True)
        if np.median(read.force_ground[known, 1]) > settings.conditioning.threshold_N
    ]
    if np.linalg.norm(pressed - below_com) > UNDER_M and not _over(loaded, skeleton, q, foot_bodies):
        return None
    blocks = max(1.0, len(up) / (settings.com.block_s * markers.rate))
    mass, sampling = float(weight) / g, float(np.std(up)) / g / blocks**0.5
    return MassEstimate(mass, float(np.hypot(sampling, settings.com.plate_gain_std * mass)), sampling)


def _over(
    plates: Sequence[ForcePlate],
    skeleton: Skeleton,
    q: Float[np.ndarray, "frames dofs"],
    foot_bodies: Sequence[str],
) -> bool:
    """Whether both soles are over these plates."""
    R, p = body_poses(skeleton, q)
    feet = independent_feet(skeleton, foot_bodies)
    pressed = [sole.middle(PRESSED) for sole in soles(skeleton, feet)]
    points = [np.median(sole.corners_ground(R, p), axis=0)[:, [0, 2]] for sole in pressed]
    corners = [plate.corners_ground[:, [0, 2]] for plate in plates if plate.corners_ground is not None]
    inside = [_within(np.concatenate(points), own) for own in corners]
    return bool(inside and np.any(inside, axis=0).all())


def _within(
    points: Float[np.ndarray, "points 2"], corners: Float[np.ndarray, "4 2"]
) -> Bool[np.ndarray, " points"]:
    """In a plate, or hardly beside it; in the plate's own axes."""
    along, across = corners[1] - corners[0], corners[-1] - corners[0]
    offset = points - corners.mean(axis=0)
    return np.all(
        [
            np.abs(offset @ axis) / np.linalg.norm(axis) < np.linalg.norm(axis) / 2 + RIM_M
            for axis in (along, across)
        ],
        axis=0,
    )
