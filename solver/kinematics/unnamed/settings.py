"""Numbers of the search for unnamed markers, each with its reason."""

from solver.kinematics.settings import KinematicsSettings

ELSEWHERE = 1e-4  # density of a marker that is on no landmark, against one 5 cm wide
RIGID_M = 0.015  # [m] likewise at last: soft tissue and placement
PROPORTIONS_M = 0.03  # [m] how far proportions move places, before segments are scaled
SCALED_PROPORTIONS_M = 0.015  # [m] likewise after segments are scaled
INDEPENDENT_FRAMES = 6.0  # [frames] soft tissue repeats: so many frames' worth is in a recording
LIMIT_STD_RAD = KinematicsSettings.limit_std_rad  # [rad] 5°: soft joint limits, as in the kinematics
FEWEST_MARKERS = 16  # without any name; fewer were fitted to a wrong shape with confidence
NAMING = KinematicsSettings()
