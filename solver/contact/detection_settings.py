"""Thresholds of the detection of missing force, each with its reason."""

import math
from dataclasses import dataclass

from solver.common.plate_figures import CONTACT_N
from solver.common.settings_field import setting
from solver.contact.settings import SHORTEST_CONTACT_S, ContactSettings


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
    balance_noise: float = setting(
        0.03, unit="", why="of body weight: what vertical balance leaves unexplained in quiet movement"
    )
    bounce_noise: float = setting(
        0.08, unit="", why="of m·a: what soft tissue and a stiff trunk leave unexplained besides"
    )
    bounce_window_s: float = setting(0.2, unit="s", why="the level of m·a is that of the last step or so")
    moment_noise_m: float = setting(
        0.02, unit="m", why="of weight and m·a: what the balance of moments leaves unexplained"
    )
    jump_m_s2: float = setting(
        100.0,
        unit="m/s²",
        why="by which the body's acceleration changes from one frame to the next: landing 3 g, markers that "
        "vanish or come back 20 g and more",
    )
    jump_offset_m: float = setting(
        0.005,
        unit="m",
        why="of such a jump, and standard deviation of what stays of it: other markers, another pelvis",
    )
    # ---- errors that last a whole trial, learnt from its measured frames
    mass_error: float = setting(
        0.04, unit="", why="standard deviation of the entered mass, with clothes, and of the plates' gains"
    )
    bounce_error: float = setting(
        0.12,
        unit="",
        why="standard deviation of how much the markers exaggerate m·a: 0 to 0.07 walking, 0.2 running",
    )
    com_error_m: float = setting(0.03, unit="m", why="standard deviation of the centre of mass, sideways")
    clock_error_s: float = setting(
        0.004, unit="s", why="standard deviation between the plates' clock and the cameras': trigger, filters"
    )
    farthest_error: float = setting(
        2.0, unit="", why="standard deviations that a trial may teach: more is no error but missing force"
    )
    # ---- contacts measured in part
    plate_error: float = setting(
        0.03, unit="", why="standard deviation of one contact's force: gains, soft tissue from step to step"
    )
    least_lost: float = setting(
        0.2, unit="", why="of the measured force: less than this is missing from no foot; plates err by 5 %"
    )
    most_lost: float = setting(
        3.0, unit="", why="of the measured force: three quarters of a foot beside a plate"
    )
    part_cost: float = setting(
        6.0,
        unit="",
        least=0.0,
        why="log odds against a contact's being measured in part: one in some hundred",
    )
    shortest_contact_s: float = setting(
        SHORTEST_CONTACT_S,
        unit="s",
        why="a sprinter's contact lasts 0.09 s; shorter ones say nothing of their share",
    )
    shortest_gap_s: float = setting(
        0.04, unit="s", why="shorter gaps don't end a contact: a flight lasts 0.08 s"
    )
    # ---- where a missing force presses
    point_noise_m: float = setting(0.04, unit="m", why="of soles and centres of mass in the model")
    half_sole_m: float = setting(0.05, unit="m", why="half a sole's width, round the line between two feet")
    least_pressing_N: float = setting(
        CONTACT_N, unit="N", why="a smaller missing force has no centre of pressure to speak of"
    )
    strongest_place: float = setting(4.0, unit="", why="log odds that one moment's place can give")
    # ---- the motion of the soles
    slip_cutoff_Hz: float = setting(12.0, unit="Hz", why="of the sole's speed; a foot lands within 30 ms")
    slip_m_s: float = setting(
        0.5, unit="m/s", why="a sole's slowest corner on the ground; a swinging one passes at 2 m/s"
    )
    slip_share: float = setting(
        0.2, unit="", why="of the speed of the trial's swinging feet: runners' soles slip more"
    )
    lowest_part_m: float = setting(
        0.05, unit="m", why="corners of a sole so near to its lowest one may be those that touch"
    )
    belt_window_s: float = setting(1.5, unit="s", why="a treadmill's belt changes its speed more slowly")
    strongest_motion: float = setting(
        2.5, unit="", why="log odds that a sole's motion can give: a foot may be held still in the air"
    )
    touching_s: float = setting(
        0.25,
        unit="s",
        why="a still foot may be without a load for so long, as in a slow double support; a standing foot "
        "carries something",
    )
    # ---- the likeliest contact states
    most_missing: float = setting(
        2.0, unit="", why="body weights: missing forces are assumed to be anything from none to this"
    )
    steady_s: float = setting(
        0.04, unit="s", why="errors this far apart are independent: half a period of the cutoff"
    )
    strongest_evidence: float = setting(
        4.0, unit="", why="log odds that one moment's balance can give: models fail more often"
    )
    elsewhere_odds: float = setting(
        3.0,
        unit="",
        least=0.0,
        why="log odds against a chair or a hand, before anything is known: plates are for feet",
    )
    partly_odds: float = setting(
        0.5,
        unit="",
        least=0.0,
        why="log odds against a loaded foot's force being wrong, before anything is known",
    )
    touch_cost: float = setting(
        1.5, unit="", least=0.0, why="of a contact's begin or end: no contact lasts 20 ms"
    )
    loss_cost: float = setting(
        6.0,
        unit="",
        least=0.0,
        why="of a force that is lost or comes back while the plate stays loaded: rare",
    )
    unloaded_cost: float = setting(
        30.0,
        unit="",
        least=0.0,
        why="of calling a foot measured while its plate is unloaded, or up while it is loaded",
    )
    rolling_s: float = setting(
        0.01,
        unit="s",
        least=0.0,
        why="so long before and after a foot may carry some 50 N: too little for the balance",
    )
    rolling_odds: float = setting(
        -0.5, unit="", least=-math.inf, why="as long as its sole is not clearly swinging"
    )
    steep: float = setting(
        0.25,
        unit="",
        why="of body weight: a missing force that changes by more in that time is no rolling foot's, and the "
        "balance's smoother shows it early",
    )
    border_s: float = setting(
        0.015,
        unit="s",
        least=0.0,
        why="added to both ends of a lost force: as far as the filter spreads it; loads are seen filtered",
    )
    sure_odds: float = setting(
        8.0, unit="", why="log odds by which the doubt about a proposal has shrunk to a third"
    )
    suspect: float = setting(
        0.5, unit="", why="of the evidence that calls a contact wrong: from there on it is proposed"
    )
    nobody_N: float = setting(CONTACT_N, unit="N", why="all plates together below it: nobody stands on them")
    # ---- what the plates themselves show
    fault_loaded_N: float = setting(
        CONTACT_N, unit="N", why="gait laboratories' usual contact threshold; faults are looked for above it"
    )
    fault_confidence: float = setting(
        0.8, unit="", why="of such a proposal: the samples are plain, their effect on the fit is not"
    )
    cop_outside_m: float = setting(
        0.07, unit="m", why="real centres of pressure leave the model's sole by 5 cm at most"
    )
    cop_load: float = setting(
        ContactSettings.full_weight_load,
        unit="",
        why="of the peak force; below it a centre of pressure is noise",
    )
    cop_outside_s: float = setting(
        0.05, unit="s", why="for so long; landing and push-off may touch the limit"
    )
    clipped_s: float = setting(
        0.008, unit="s", why="at its largest value without a change: no peak is so flat"
    )
    clipped_samples: int = setting(4, unit="samples", why="and for so many, where samples are rare")
    clipped_N: float = setting(200.0, unit="N", why="amplifiers saturate at large forces")
    clipped_drop: float = setting(
        0.02, unit="", why="of it, lost within as long again on both sides: a round peak loses less"
    )
    held_s: float = setting(0.1, unit="s", why="a loaded plate that repeats one value so long is stuck")
    spike_s: float = setting(0.002, unit="s", why="no step rises and falls within it, not even a sprinter's")
    spike: float = setting(0.5, unit="", why="of body weight: smaller spikes vanish in the 30 Hz filter")
    dropout_s: float = setting(
        0.08, unit="s", why="no foot leaves the plate at full load and is back so soon"
    )
    dropout: float = setting(0.2, unit="", why="of body weight carried right before and after a dropout")
