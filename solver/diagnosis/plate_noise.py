"""White noise of the plates, as large as their own samples tell, in the windows of the balance.

Low-passed recordings have none. Where raw ones are sampled no faster than the markers, a window averages few
of them, and what is left can be more than any filtered plate's noise.
"""

import numpy as np
from jaxtyping import Float

from solver.dynamics.windows import Windows
from solver.effects.scene import PlateScene, Scene
from solver.skeleton.forward import cross
from solver.skeleton.rotations import skew
from solver.white_noise import white_noise

SLOWEST_HZ = 80.0  # samples: of slower ones, steps look like noise


def plate_noise(plate: PlateScene) -> Float[np.ndarray, "6"]:
    """Standard deviation of a sample's force [N] and moment about the plate's centre [N·m], while loaded."""
    recorded = plate.plate
    if recorded.rate < SLOWEST_HZ:
        return np.zeros(6)
    moment = recorded.moment_ground - cross(plate.centre_ground, recorded.force_ground)
    wrench = np.concatenate([recorded.force_ground, moment], axis=1)
    return np.nan_to_num(white_noise(np.where(plate.loads.carrying[:, None], wrench, np.nan)))


def plates_noise(scene: Scene, windows: Windows) -> Float[np.ndarray, "windows 6 6"]:
    """Covariance of each window's measured force [N] and moment about the centre of mass [N·m].

    Args:
        scene: with its plates at the markers' frames.
        windows: of the balance; what two of them share is left out.
    """
    total = np.zeros((windows.count, 6, 6))
    per_second = scene.rate * float(
        (windows.weights**2).sum()
    )  # of a window: of noise of one sample a second
    com = windows.means(scene.com_ground)
    for plate in scene.plates:
        variance = plate_noise(plate) ** 2 * per_second / plate.plate.rate
        if not variance.any():
            continue
        about_com = np.tile(np.eye(6), (windows.count, 1, 1))
        about_com[:, 3:, :3] = skew(plate.centre_ground - com)
        loaded = windows.means(plate.loaded.astype(float))
        total += loaded[:, None, None] * (about_com * variance) @ about_com.transpose(0, 2, 1)
    return total
