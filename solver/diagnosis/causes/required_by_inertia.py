"""What bodies' inertias, or changes of them, demand of the world outside."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.scene import Scene
from solver.dynamics.inertia_parameters import pseudo_inertia, required_wrench


def required_by_changes(
    scene: Scene, body: int, changes: Float[np.ndarray, "changes 4 4"]
) -> Float[np.ndarray, "frames 6 changes"]:
    """Wrench about the ground origin that each change of a body's pseudo-inertia demands [N, N·m]."""
    one = slice(body, body + 1)
    required = required_wrench(scene.material[:, one], scene.T_ground_body[:, one], changes[None])
    return required[:, 0].transpose(0, 2, 1)


def required_by_bodies(scene: Scene, bodies: Sequence[int]) -> Float[np.ndarray, "frames 6"]:
    """Wrench about the ground origin that these bodies as they are in the model demand [N, N·m]."""
    chosen = list(bodies)
    J = np.stack([pseudo_inertia(scene.skeleton.bodies[b]) for b in chosen])
    return required_wrench(scene.material[:, chosen], scene.T_ground_body[:, chosen], J).sum(axis=1)
