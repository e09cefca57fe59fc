"""Thresholds of the detection of missing force, each with its reason."""

from dataclasses import dataclass

from solver.settings_field import setting


@dataclass(frozen=True)
class DetectionSettings:
    """When a force is held to be missing, and how sure that has to be."""

    confidence: float = setting(
        0.5, unit="", why="proposals at least this sure leave their frames out of a fit nobody has reviewed"
    )
    balance_cutoff_Hz: float = setting(
        8.0, unit="Hz", why="of the unexplained force: steps show to two frames, markers' noise hardly"
    )
    balance_noise: float = setting(
        0.03, unit="", why="of body weight: what vertical balance leaves unexplained in quiet movement"
    )
    bounce_noise: float = setting(
        0.2,
        unit="",
        why="of m·a: soft tissue and a rigid trunk exaggerate the bounce; 10 % walking, 20 % running",
    )
    bounce_window_s: float = setting(0.2, unit="s", why="the level of m·a is that of the last step or so")
    mass_error: float = setting(
        0.04, unit="", why="standard deviation of the entered mass with clothes, and of the plates' gains"
    )
    known_mass_error: float = setting(
        0.02, unit="", why="what remains of it once this trial's own measured frames have been weighed"
    )
    weighed_s: float = setting(0.5, unit="s", why="of measured frames that it takes to weigh the person")
    most_missing: float = setting(
        2.0, unit="", why="body weights: missing forces are taken to be anything from none to this"
    )
    steady_s: float = setting(
        0.06, unit="s", why="errors this far apart are independent: half a period of the cutoff"
    )
    strongest_evidence: float = setting(
        4.0, unit="", why="natural logarithm of the odds that one moment can give: models fail more often"
    )
    slip_cutoff_Hz: float = setting(12.0, unit="Hz", why="of the sole's speed; a foot lands within 30 ms")
    slip_m_s: float = setting(
        0.5, unit="m/s", why="a sole's slowest corner on the ground; a swinging one passes at 2 m/s"
    )
    lowest_part_m: float = setting(
        0.05, unit="m", why="corners of a sole so near to its lowest one may be those that touch"
    )
    belt_window_s: float = setting(1.5, unit="s", why="a treadmill's belt changes its speed more slowly")
    touch_cost: float = setting(1.5, unit="", why="of a contact's begin or end: no contact lasts 20 ms")
    loss_cost: float = setting(
        6.0, unit="", why="of a force that is lost or comes back while the plate stays loaded: rare"
    )
    unloaded_cost: float = setting(
        6.0, unit="", why="of a foot that is said to be measured while its plate is unloaded, or the reverse"
    )
    border_s: float = setting(0.01, unit="s", why="added at both ends of what is proposed: filters spread it")
