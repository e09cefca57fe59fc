"""When a label is taken to be on the wrong trajectory, each limit with its reason."""

from dataclasses import dataclass

from solver.common.settings_field import setting

# [m] a distance on one body that scatters less (1.48 × median deviation) is kept: skin moves 2-8 mm, and an
# exchange on two frames of five doubles what is seen
RIGID_M = 0.02
LOOSEST_HOLD_M = 0.02  # [m] however much skin moves: beyond it nothing could be told from a fault
EXCHANGED_BACK_SHARE = 0.5  # exchanged back, distances may be off by at most this share of what they were
CLEAR_SHARE = 0.8  # of a stretch's frames must be clearly wrong; neighbours may be hidden on the rest
FEWEST_FRAMES = 3  # [frames] fewer are left to the fit's robust loss


@dataclass(frozen=True)
class LabelRepairSettings:
    """Exchanged labels and labels that leave their segment; a false repair is worse than a miss."""

    enabled: bool = setting(True, unit="", why="false: labels stay as the files have them")
