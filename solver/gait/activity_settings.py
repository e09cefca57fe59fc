"""Thresholds of suggested activities."""

from dataclasses import dataclass

from solver.common.settings_field import setting


@dataclass(frozen=True)
class ActivitySettings:
    """How stretches of one activity are found; docs/explanation/gait.md says how often it is right."""

    window_s: float = setting(2.0, unit="s", why="about two strides of a walk, one squat")
    hop_s: float = setting(0.5, unit="s", why="borders of stretches are no sharper than a step")
    least_confidence: float = setting(0.6, unit="", why="below, nothing is suggested: a person looks anyway")
    least_share: float = setting(
        0.02, unit="", why="no window speaks against an activity more than fifty to one"
    )
    sure_share: float = setting(
        0.9, unit="", why="of a window of 2 s, whose word a change of activity costs; less would flicker"
    )
    least_own_share: float = setting(
        0.4, unit="", why="of a window in its stretch; below, it looks like something else"
    )
    named_odds: float = setting(
        3.0, unit="", why="a trial's name is often right, and also says what people only meant to do"
    )
    belt_m_s: float = setting(0.3, unit="m/s", why="slower treadmills are not walked on")
    belt_travel: float = setting(0.3, unit="", why="of the way over the surface; on a belt the body stays")
    riser_m: float = setting(0.08, unit="m", why="risers of stairs are 0.10 to 0.22 m")
    ramp: float = setting(0.03, unit="", why="slope of contacts; floors of laboratories are level")
    box_m: float = setting(0.15, unit="m", why="between floor and box; runners' feet differ by less")
    flight_s: float = setting(0.1, unit="s", why="of a jump; shorter ones are noise of the feet's contacts")
    pause_s: float = setting(0.3, unit="s", why="in a squat before a jump, without which it is a swing")
    knee_deg: float = setting(60.0, unit="deg", why="of flexion, from which on knees are deep")
    sitting_BW: float = setting(0.9, unit="body weights", why="a seat bears more than a tenth of the weight")
    rise: float = setting(0.15, unit="leg lengths", why="by which a pelvis rises from a chair, at the least")
    lunge_step: float = setting(0.4, unit="leg lengths", why="fore-aft between the feet of a lunge")
    still: float = setting(0.1, unit="m/s", why="of the pelvis: slower, a person stands")
    walking_m_s: float = setting(0.4, unit="m/s", why="faster, a person surely walks")
    one_foot_s: float = setting(1.0, unit="s", why="unloaded: no step of a walk takes as long")


ACTIVITIES = ActivitySettings()
