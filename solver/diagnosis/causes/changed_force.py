"""What it does to a plate's wrench if its force columns were others and its centres of pressure stay."""

import numpy as np
from jaxtyping import Float

from solver.capture.plates.centre_of_pressure import centre_of_pressure, surface_of
from solver.diagnosis.causes.scene import PlateScene, force_at


def points_ground(plate: PlateScene) -> Float[np.ndarray, "samples 3"]:
    """Centre of pressure of each sample, from recorded force and moment [m]; zero where unloaded."""
    wrench = plate.loads.wrench_ground
    points = centre_of_pressure(wrench[:, :3], wrench[:, 3:], surface_of(plate.plate, plate.conditioning))
    return np.where(plate.loads.carrying[:, None], points, 0.0)


def wrench_change(
    plate: PlateScene, force_change_ground: Float[np.ndarray, "samples 3"]
) -> Float[np.ndarray, "frames 6"]:
    """Change of the plate's wrench at the frames; centres of pressure and free moments stay.

    Args:
        plate: as recorded.
        force_change_ground: of its samples, zero where unloaded [N].
    """
    return np.nan_to_num(plate.at_frames(force_at(force_change_ground, points_ground(plate))))
