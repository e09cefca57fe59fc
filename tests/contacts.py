"""What acts on feet, told by hand."""

import numpy as np
from jaxtyping import Float

from solver.contact.wrenches import ContactWrenches


def contacts_of(
    foot_bodies: tuple[str, ...], wrench_ground: Float[np.ndarray, "frames feet 6"], **told: object
) -> ContactWrenches:
    """Seen on all frames; unless `told` otherwise in contact on none, of no plate, and nobody knows where."""
    frames, feet = wrench_ground.shape[:2]
    untold = {
        "cop_ground": np.full((frames, feet, 3), np.nan),
        "observed": np.ones(frames, dtype=bool),
        "in_contact": np.zeros((frames, feet), dtype=bool),
        "plate": np.zeros((frames, 0), dtype=int),
        "wrench_raw_ground": wrench_ground,
    }
    return ContactWrenches(foot_bodies, wrench_ground, **{**untold, **told})
