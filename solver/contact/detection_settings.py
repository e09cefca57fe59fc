"""Thresholds of the detection of missing force, each with its reason."""

from dataclasses import dataclass

from solver.common.settings_field import setting

LEAST_LOST = 0.2  # of the measured force: less than this is missing from no foot; plates err by 5 %
MOST_LOST = 3.0  # of the measured force: three quarters of a foot beside a plate
PART_COST = 6.0  # log odds against a contact's being measured in part: one in some hundred
STEADY_S = 0.04  # [s] errors this far apart are independent: half a period of the cutoff
# [s] added to both ends of a lost force: as far as the filter spreads it; loads are seen filtered
BORDER_S = 0.015
DROPOUT = 0.2  # of body weight carried right before and after a dropout


@dataclass(frozen=True)
class DetectionSettings:
    """When a force is held to be missing, and how sure that has to be."""

    confidence: float = setting(
        0.5, unit="", why="proposals at least this sure leave their frames out of a fit nobody has reviewed"
    )
    # ---- balance of the whole body
    balance_cutoff_Hz: float = setting(
        12.0, unit="Hz", why="of the missing force: a step's edges show to two frames, markers' noise hardly"
    )
    place_cutoff_Hz: float = setting(
        4.0, unit="Hz", why="of the moments: where a force acts changes slowly, and their noise is larger"
    )
    # ---- errors that last a whole trial, learnt from its measured frames
    mass_error: float = setting(
        0.04, unit="", why="standard deviation of the entered mass, with clothes, and of the plates' gains"
    )
    com_error_m: float = setting(0.03, unit="m", why="standard deviation of the centre of mass, sideways")
    clock_error_s: float = setting(
        0.004, unit="s", why="standard deviation between the plates' clock and the cameras': trigger, filters"
    )
    # ---- contacts measured in part
    plate_error: float = setting(
        0.03, unit="", why="standard deviation of one contact's force: gains, soft tissue from step to step"
    )
    # ---- where a missing force presses
    # ---- the motion of the soles
    # ---- the likeliest contact states
    suspect: float = setting(
        0.5, unit="", why="of the evidence that calls a contact wrong: from there on it is proposed"
    )
    # ---- what the plates themselves show
    cop_outside_m: float = setting(
        0.07, unit="m", why="real centres of pressure leave the model's sole by 5 cm at most"
    )
