"""Where points of the feet are, and how they move with the coordinates."""

import numpy as np
from jaxtyping import Float

from solver.simulate.sole import SIDES, Sole
from solver.skeleton.forward import ForwardKinematics, Poses, cross
from solver.skeleton.skeleton import Skeleton


class FootPoints:
    """The points of both feet that stay put in stance: right foot first, in the order of the sole's list."""

    def __init__(self, skeleton: Skeleton, sole: Sole) -> None:
        self.kinematics = ForwardKinematics(skeleton)
        chain = self.kinematics.chain
        self._to_dofs = np.zeros((chain.positions, chain.dofs))
        self._to_dofs[np.arange(chain.positions), chain.dof] = 1.0
        self.body_names = tuple(body for body, _ in sole.planted_points())
        self.flat_sole = np.stack([sole.flat_position(*point) for point in sole.planted_points()])
        self._bodies: list[int] = []
        self._positions: list[np.ndarray] = []
        for side in SIDES:
            for body, position in sole.planted_points():
                self._bodies.append(skeleton.body_index(f"{body}_{side}"))
                self._positions.append(position * ((1, 1, -1) if side == "l" else (1, 1, 1)))

    def positions(self, q: Float[np.ndarray, "times dofs"]) -> Float[np.ndarray, "times feet points 3"]:
        """Positions in the ground frame [m]."""
        return self._positions_in(self.kinematics.poses(q))[0]

    def slopes(
        self, q: Float[np.ndarray, "times dofs"]
    ) -> tuple[Float[np.ndarray, "times feet points 3"], Float[np.ndarray, "times feet points 3 dofs"]]:
        """Positions, and their derivatives by q."""
        poses = self.kinematics.poses(q)
        positions, flat = self._positions_in(poses)
        twists = poses.twists()
        slopes = np.empty((*flat.shape, self._to_dofs.shape[1]))
        for k, body in enumerate(self._bodies):
            columns = np.flatnonzero(self.kinematics.carries[:, body])
            angular, linear = twists[:, columns, :3], twists[:, columns, 3:]
            moves = cross(angular, flat[:, k, None, :]) + linear
            slopes[:, k] = moves.transpose(0, 2, 1) @ self._to_dofs[columns]
        return positions, slopes.reshape(*positions.shape, -1)

    def _positions_in(self, poses: Poses) -> tuple[np.ndarray, np.ndarray]:
        """Positions by foot and point, and in one row."""
        flat = np.stack(
            [
                poses.p_ground_body[:, body] + poses.R_ground_body[:, body] @ position
                for body, position in zip(self._bodies, self._positions, strict=True)
            ],
            axis=1,
        )
        return flat.reshape(len(flat), len(SIDES), -1, 3), flat
