import numpy as np

from solver.dynamics.trajectory.terms.priors import UNDETERMINED_STD_RAD, PosePull, pull_precision
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings

SETTINGS = TrajectorySettings()


def test_gauss_newton_is_that_of_dense_rows(case):
    root = [case.skeleton.dofs.index(name) for name in ("tilt", "list", "turn", "tx", "ty", "tz")]

    def rows(iterate):
        away = np.delete(case.at(iterate).q - case.data.start.q, root, axis=1)
        return np.sqrt(case.frame_weight) * away.ravel() / SETTINGS.pose_std_rad

    pull = PosePull(case.data.start, pull_precision(case.skeleton, case.data.observed_ground, SETTINGS))
    case.assert_least_squares(pull, rows)


def test_what_no_marker_tells_is_held_nearer(case):
    """The furthest body's markers never seen: only its own joint loses everything that tells it."""
    last = max(marker.body for marker in case.skeleton.markers)
    unseen = case.data.observed_ground.copy()
    unseen[:, [marker.body == last for marker in case.skeleton.markers]] = np.nan
    own = {a.coordinate for a in case.skeleton.joints[last].axes} & set(case.skeleton.dofs)
    seen, gone = (
        dict(zip(case.skeleton.dofs, pull_precision(case.skeleton, x, SETTINGS), strict=True))
        for x in (case.data.observed_ground, unseen)
    )
    assert own
    assert {dof for dof in seen if seen[dof] != gone[dof]} == own
    assert all(gone[dof] == UNDETERMINED_STD_RAD**-2 for dof in own)
