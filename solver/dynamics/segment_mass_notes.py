"""What to say of segments that forces make heavier or lighter than people are."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.dynamics.inertia_parameters import inertia_parameters
from solver.dynamics.trajectory_search import TrajectoryFit
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.skeleton.skeleton import Skeleton


def segment_mass_notes(
    nominal: Skeleton, fit: TrajectoryFit, settings: TrajectorySettings
) -> tuple[str, ...]:
    """A note that names segments and ratios where forces ask for more than people's scatter; else nothing.

    Args:
        nominal: scaled, that the fit's inertias are changes of.
        fit: of it.
        settings: from which ratio on.
    """
    if not settings.fit_inertias:
        return ()
    inertias = inertia_parameters(nominal, settings)
    asked = inertias.pseudo_inertias(fit.asked_phi)[:, 3, 3]
    ratios = _ratios(nominal, asked)
    kept = _ratios(nominal, [body.mass for body in fit.skeleton.bodies])
    said = []
    for group in range(len(inertias.names)):
        bodies = np.flatnonzero(inertias.group == group)
        first = bodies[0]
        if max(abs(ratios[first] - 1), abs(kept[first] - 1)) <= settings.notable_segment_mass:
            continue
        names = " and ".join(nominal.bodies[b].name for b in bodies)
        said.append((abs(ratios[first] - 1), f"{names} {ratios[first]:.2f} (the fit has {kept[first]:.2f})"))
    if not said:
        return ()
    listed = ", ".join(text for _, text in sorted(said, reverse=True))
    return (
        "the forces would fit better with other segment masses than the tables give, by the factors: "
        f"{listed}; do forces come late, is a plate turned or misplaced, is something carried, or is the "
        "body unlike the tables? Soft tissue has the same effect, above all in runs and landings",
    )


def _ratios(
    nominal: Skeleton, masses: Sequence[float] | Float[np.ndarray, " bodies"]
) -> Float[np.ndarray, " bodies"]:
    """To the nominal masses; 1 where a segment has none."""
    own = np.array([body.mass for body in nominal.bodies])
    return np.divide(np.asarray(masses), own, out=np.ones(len(own)), where=own > 0)
