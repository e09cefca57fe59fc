"""When a label is taken to be on the wrong trajectory, each limit with its reason."""

from dataclasses import dataclass

from solver.capture.trajectory_joining import JoiningSettings
from solver.common.settings_field import setting


@dataclass(frozen=True)
class LabelRepairSettings:
    """Exchanged labels and labels that leave their segment; a false repair is worse than a miss."""

    enabled: bool = setting(True, unit="", why="false: labels stay as the files have them")
    rigid_m: float = setting(
        0.02,
        unit="m",
        why="a distance on one body that scatters less (1.48 × median deviation) is kept: skin moves 2-8 mm, "
        "and an exchange on two frames of five doubles what is seen",
    )
    rigid_across_m: float = setting(
        0.01,
        unit="m",
        why="likewise to the next body, where joints bend: used where the own body has too few",
    )
    reach_m: float = setting(JoiningSettings.reach_m, unit="m", why="no segment is longer")
    hold_m: float = setting(
        0.012,
        unit="m",
        why="distances off by less hold (RMS over neighbours), or by twice the marker's median",
    )
    loosest_hold_m: float = setting(
        0.02, unit="m", why="however much skin moves: beyond it nothing could be told from a fault"
    )
    exchanged_m: float = setting(
        0.012, unit="m", why="recorded labels must be off by more; markers nearer than that matter little"
    )
    better: float = setting(
        0.5, unit="", why="exchanged back, distances may be off by at most this share of what they were"
    )
    repaired_share: float = setting(
        0.25, unit="", why="likewise in the median over the stretch: real exchanges reach 0.02 to 0.2"
    )
    clear_share: float = setting(
        0.8, unit="", why="of a stretch's frames must be clearly wrong; neighbours may be hidden on the rest"
    )
    crash_m: float = setting(
        0.04, unit="m", why="off its segment; soft tissue and loose markers stay below in running and landing"
    )
    same_place_m: float = setting(
        0.01, unit="m", why="two labels this near are on one trajectory; markers are 9-25 mm across"
    )
    apart_m: float = setting(0.03, unit="m", why="markers usually nearer than that may well meet")
    most_share: float = setting(
        0.4, unit="", why="of the frames: what holds for most of them is assumed to be right"
    )
    fewest_frames: int = setting(3, unit="frames", why="fewer are left to the fit's robust loss")
    fewest_neighbours: int = setting(
        2, unit="", why="distances that tell a place; one alone is wrong when its other end is"
    )
    fewest_across_joints: int = setting(
        3, unit="", why="likewise where some are on the next body, before a label is left out: joints bend"
    )
    step_frames: int = setting(
        2, unit="frames", why="a label changes trajectories at once; what takes longer is movement"
    )
    longest_gap_s: float = setting(
        1.0, unit="s", why="a fault begins or ends in a gap no longer than that, or at a step"
    )
