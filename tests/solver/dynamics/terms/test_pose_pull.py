import numpy as np

from solver.dynamics.terms.pose_pull import PosePull
from solver.dynamics.trajectory_settings import TrajectorySettings

SETTINGS = TrajectorySettings()


def test_gauss_newton_is_that_of_dense_rows(case):
    root = [case.skeleton.dofs.index(name) for name in ("tilt", "list", "turn", "tx", "ty", "tz")]

    def rows(iterate):
        away = np.delete(case.at(iterate).q - case.data.start.q, root, axis=1)
        return np.sqrt(case.frame_weight) * away.ravel() / SETTINGS.pose_std_rad

    case.assert_least_squares(PosePull(case.skeleton, case.data.start, SETTINGS), rows)
