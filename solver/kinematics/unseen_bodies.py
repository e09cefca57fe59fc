"""Segments that no marker showed, wholly or for a while: their pose is a guess, and the fit says so."""

import numpy as np
from jaxtyping import Bool, Float

from solver.common.notes import Kind, Note, noted
from solver.common.true_runs import runs
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

LONG_S = 0.1  # shorter gaps are bridged within millimetres
NOTABLE_MASS = 0.03  # of the body's; an arm weighs 5 %, a hand or a foot's toes less than 1 %
UNSEEN_MASS = "unseen_mass_share"  # value of a note: of the body's mass, that no marker shows moving
MOST_LISTED = 5  # stretches named; the rest is counted


def unseen_body_notes(
    skeleton: Skeleton, observed_ground: Float[np.ndarray, "frames markers 3"], motion: Motion
) -> tuple[Note, ...]:
    """A note for all segments that lose their markers on the same frames.

    Args:
        skeleton: its markers are those of `observed_ground`, in the same order.
        observed_ground: NaN where unseen [m].
        motion: of the trial; of frames without a pose nothing is said.
    """
    seen = np.isfinite(observed_ground).all(axis=2) | ~motion.posed[:, None]
    bodies_by_stretches: dict[tuple[tuple[int, int], ...], list[str]] = {}
    for body in sorted({marker.body for marker in skeleton.markers}):
        own = [marker.body == body for marker in skeleton.markers]
        stretches = _long(~seen[:, own].any(axis=1), motion)
        if stretches:
            bodies_by_stretches.setdefault(stretches, []).append(skeleton.bodies[body].name)
    notes: list[Note] = []
    for stretches, bodies in bodies_by_stretches.items():
        if sum(end - start for start, end in stretches) == motion.posed.sum():
            notes += noted(
                Kind.BARE_BODIES, f"no marker on {', '.join(bodies)} is ever seen: how they move is a guess"
            )
            continue
        notes += noted(
            Kind.BARE_BODIES,
            f"no marker on {', '.join(bodies)} is seen in frames {_listed(stretches)}: "
            "their pose is interpolated",
        )
    return tuple(notes)


def unseen_frame_notes(motion: Motion) -> tuple[Note, ...]:
    """A note on the frames without a pose."""
    lost = runs(~motion.posed)
    if not lost:
        return ()
    listed = ", ".join(
        f"{start}-{end - 1} ({motion.times[start]:.2f} to {motion.times[end - 1]:.2f} s)"
        for start, end in lost[:MOST_LISTED]
    )
    more = f" and {len(lost) - MOST_LISTED} more stretches" if len(lost) > MOST_LISTED else ""
    return noted(
        Kind.OUT_OF_VIEW,
        f"no pose on {int((~motion.posed).sum())} of {motion.frames} frames, where too few markers are "
        f"seen to determine one: {listed}{more}. Nothing is said of these frames",
    )


def guessed_notes(
    motion: Motion,
    guessed: Bool[np.ndarray, "frames dofs"],
    why: str = "markers that would show it are out of view for too long",
) -> tuple[Note, ...]:
    """A note for all coordinates that are guessed on the same frames.

    Args:
        motion: of the trial; of frames without a pose nothing is said.
        guessed: where no marker in view shows a coordinate, for longer than can be bridged.
        why: no angle is told there.
    """
    by_stretches: dict[tuple[tuple[int, int], ...], list[str]] = {}
    for dof, there in zip(motion.dofs, (guessed & motion.posed[:, None]).T, strict=True):
        if there.any():
            by_stretches.setdefault(tuple(runs(there)), []).append(dof)
    return tuple(
        Note(
            Kind.OUT_OF_VIEW,
            f"no angle of {', '.join(dofs)} in frames {_listed(stretches)}: {why}. "
            "Files that need whole poses hold a guess there",
        )
        for stretches, dofs in by_stretches.items()
    )


def _listed(stretches: tuple[tuple[int, int], ...]) -> str:
    more = f" and {len(stretches) - MOST_LISTED} more stretches" if len(stretches) > MOST_LISTED else ""
    return ", ".join(f"{start}-{end - 1}" for start, end in stretches[:MOST_LISTED]) + more


def unseen_mass_notes(
    skeleton: Skeleton, observed_ground: Float[np.ndarray, "frames markers 3"]
) -> tuple[Note, ...]:
    """A note on how much of the body's mass moves by guess; forces that a motion demands lack its share.

    Args:
        skeleton: its markers are those of `observed_ground`, in the same order.
        observed_ground: NaN where unseen [m].
    """
    seen = np.isfinite(observed_ground).all(axis=2).any(axis=0)
    carries = {marker.body for marker, s in zip(skeleton.markers, seen, strict=True) if s}
    for body in reversed(range(len(skeleton.bodies))):
        if body in carries:
            carries.add(skeleton.joints[body].parent)
    untold = undetermined_dofs(skeleton, observed_ground)
    guessed = []
    for body, joint in enumerate(skeleton.joints):
        own = [axis.coordinate in skeleton.dofs for axis in joint.axes]
        free = any(
            untold[skeleton.dofs.index(axis.coordinate)]
            for axis, is_free in zip(joint.axes, own, strict=True)
            if is_free
        )
        if body not in carries and (free or joint.parent in guessed):
            guessed.append(body)
    mass = sum(skeleton.bodies[body].mass for body in guessed)
    if mass < NOTABLE_MASS * skeleton.mass:
        return ()
    names = ", ".join(skeleton.bodies[body].name for body in guessed)
    share = mass / skeleton.mass
    moves = f"no marker shows how {100 * share:.0f} % of the mass moves ({names})"
    return (Note(Kind.OTHER, f"{moves}: the predicted forces lack their share", values={UNSEEN_MASS: share}),)


def undetermined_dofs(
    skeleton: Skeleton, observed_ground: Float[np.ndarray, "frames markers 3"] | None = None
) -> Bool[np.ndarray, " dofs"]:
    """Degrees of freedom that move no marker: those of joints beyond which none is ever seen.

    Args:
        skeleton: its markers are those of `observed_ground`, in the same order.
        observed_ground: NaN where unseen [m]; None: every marker of the skeleton is seen.
    """
    markers = skeleton.markers
    if observed_ground is not None:
        seen = np.isfinite(observed_ground).all(axis=2).any(axis=0)
        markers = tuple(m for m, s in zip(markers, seen, strict=True) if s)
    carries = {marker.body for marker in markers}
    for body in reversed(range(len(skeleton.bodies))):
        if body in carries:
            carries.add(skeleton.joints[body].parent)
    moving = {a.coordinate for body in carries if body >= 0 for a in skeleton.joints[body].axes}
    driven = {c.coupled_to for c in skeleton.coordinates if c.name in moving}
    return np.array([dof not in moving | driven for dof in skeleton.dofs])


def _long(unseen: Bool[np.ndarray, " frames"], motion: Motion) -> tuple[tuple[int, int], ...]:
    """Stretches of some length, and any that is the whole trial."""
    return tuple(
        (int(start), int(end))
        for start, end in runs(unseen)
        if end - start > LONG_S * motion.rate or end - start == motion.posed.sum()
    )
