"""Settings of the diagnosis, each with its reason."""

import math
from dataclasses import dataclass, field

from solver.common.settings_field import setting
from solver.dynamics.force_prediction.marker_noise import MarkerNoise


@dataclass(frozen=True)
class DiagnosisSettings:
    """What counts as noise, what as model error, and from where on something is said to be wrong."""

    markers: MarkerNoise = field(default_factory=MarkerNoise)
    signature_cutoff_Hz: float = setting(
        20.0, unit="Hz", why="signatures are computed from motion below it: above, accelerations are noise"
    )
    window_s: float = setting(0.06, unit="s", why="shorter than anything that markers can tell of a force")
    hop_s: float = setting(0.03, unit="s", why="half a window: nothing is lost between them")
    most_rows: int = setting(2400, unit="", why="the evidence is a dense matrix; longer trials hop farther")
    end_s: float = setting(0.05, unit="s", least=0.0, why="at both ends of a trial the spline is loose")
    force_noise_N: float = setting(
        2.0, unit="N", why="of a filtered plate; white noise of raw ones comes on top (`plate_noise`)"
    )
    moment_noise_Nm: float = setting(
        1.3, unit="N·m", why="likewise: 2 mm of centre of pressure at body weight"
    )
    body_mass_std: float = setting(0.008, unit="", why="relative: a scale's reading, clothes and shoes")
    unweighed_mass_std: float = setting(
        0.012,
        unit="",
        why="relative, where no mass was entered: what forces carry, of which some may be missing. With "
        "more, a foot beside the plates all along would only seem to make the person lighter",
    )
    segment_mass_std: float = setting(
        0.06, unit="", why="relative scatter of segments' masses between people"
    )
    segment_com_std_m: float = setting(0.008, unit="m", why="scatter of their centres of mass, and of joints")
    segment_inertia_std: float = setting(0.10, unit="", why="relative scatter of their moments of inertia")
    bounce_std: float = setting(
        0.10, unit="", why="skin and a stiff trunk exaggerate the motion of the centre of mass by 10 to 20 %"
    )
    sway_std: float = setting(
        0.05, unit="", why="likewise along the ground, where nearly all of such motion is real"
    )
    spin_std: float = setting(
        0.10, unit="", why="likewise of the spin, which a person's build changes as well"
    )
    tissue_std_m_per_rad: float = setting(
        0.008, unit="m/rad", why="how far a segment's markers slide together as the joints beside it turn"
    )
    laboratory: tuple[tuple[str, float], ...] = setting(
        (),
        unit="cause, its unit",
        why="what tared and calibrated plates are off by all the same, in place of what stands beside "
        "the cause (docs/reference/causes.md), less than half of what anybody acts on. Not gains: with them "
        "free, however little, the entered mass holds nothing",
    )
    tissue_least_share: float = setting(0.02, unit="", why="of body mass; lighter segments hardly matter")
    model_force_share: float = setting(
        0.008, unit="BW", why="what the model gets wrong for a tenth of a second at a time"
    )
    model_motion_share: float = setting(0.06, unit="", why="likewise, of the force that accelerations demand")
    model_arm_m: float = setting(
        0.008, unit="m", why="lever of such errors about the centre of mass, times body weight"
    )
    model_time_s: float = setting(0.06, unit="s", why="how long they last")
    model_scale_std: float = setting(
        0.7, unit="", why="logarithm: how much such errors differ between recordings"
    )
    model_scales: tuple[float, ...] = setting(
        (0.09, 0.125, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0),
        unit="",
        why="between which it is sought, for every hypothesis anew",
    )
    slacks: tuple[float, ...] = setting(
        (0.5, 0.7, 1.0),
        unit="",
        why="of how far soft tissue slides at most; sought likewise. More would take in what is wrong",
    )
    slack_std: float = setting(0.5, unit="", why="logarithm: how much persons differ in that")
    block_s: float = setting(0.5, unit="s", why="held out at a time: a stance or half a second")
    refitted: int = setting(10, unit="", why="the best of the screening; a cause that matters is among them")
    most_effects: int = setting(
        5, unit="", why="a recording with more causes than that is better recorded anew"
    )
    least_gain: float = setting(8.0, unit="nats", why="of log evidence; clean recordings rarely reach it")
    quiet_scale: float = setting(
        0.125, unit="", why="of the model's errors, up to which there is next to nothing to imitate a cause"
    )
    quiet_least_gain: float = setting(
        5.0,
        unit="nats",
        why="asked of a first cause there: in 40 clean recordings so quiet none gained 2, while in sound "
        "real ones with more model error some gain 7",
    )
    never_imitated: tuple[tuple[str, float], ...] = setting(
        (),
        unit="cause, nats",
        why="less is asked of such a first cause than `least_gain`, since no model's error looks like it; in "
        "place of what stands beside the cause (docs/reference/causes.md)",
    )
    least_further_gain: float = setting(
        10.0,
        unit="nats",
        least=0.0,
        why="of every cause after the first, which has the rest of the first to explain as well",
    )
    least_of_two: float = setting(
        4.0, unit="nats", why="of each of two causes alone, that may stand out only together"
    )
    most_mass_strain: float = setting(
        2.5, unit="", why="standard deviations that a cause may need the body's mass from the entered one"
    )
    tried_in_pairs: int = setting(6, unit="", why="the best of the refitted, each with each")
    most_evaluations: float = setting(
        8e6,
        unit="rows",
        least=0.0,
        why="of the balance, fitted with sets of causes at pairs of scales; then the search ends with what "
        "held up so far and says so. The longest known takes 6e6; counted, not timed: the same files always "
        "get the same answer",
    )
    exchange_margin: float = setting(
        2.0,
        unit="nats",
        least=0.0,
        why="by which another cause must do better beside all others to take a place",
    )
    least_held_out_gain: float = setting(
        0.0,
        unit="nats",
        least=-math.inf,
        why="of log density of held-out blocks; a wrong mass gains little there, since the other blocks tell "
        "it even against the prior",
    )
    held_out_share: float = setting(
        0.05,
        unit="",
        why="of its gain, that a cause without its own time history may lose on held-out blocks: the others "
        "predict a plate's place without it, at the price of an unlikely body",
    )
    mass_held_out_share: float = setting(
        0.4,
        unit="",
        why="likewise of a mass, which follows the other blocks anyway",
    )
    handicaps: tuple[tuple[str, float], ...] = setting(
        (),
        unit="cause, nats",
        least=-math.inf,
        why="log prior odds against causes that are rare, or that generic models imitate on sound "
        "recordings, in place of those that stand beside the cause (docs/reference/causes.md)",
    )
    start_margin: float = setting(
        6.0,
        unit="nats",
        least=0.0,
        why="within which another first cause is tried as well: what it leads to decides",
    )
    start_share: float = setting(0.05, unit="", least=0.0, why="of the gain, likewise")
    most_starts: int = setting(2, unit="", why="likewise, beside the first; each takes as long")
    direct_check_margin: float = setting(
        10.0,
        unit="nats",
        least=0.0,
        why="by which others must do better than a foot that is seen to stand where nothing measures, to be "
        "tried before it",
    )
    least_unknown_gain: float = setting(
        15.0, unit="nats", why="of a force of any time history, which is free to follow noise"
    )
    unknown_margin: float = setting(
        12.0, unit="nats", least=0.0, why="by which a force of any time history must beat named causes"
    )
    unknown_share: float = setting(
        0.1,
        unit="",
        why="of what named causes explain, likewise: a free time history follows model errors",
    )
    most_constant: float = setting(
        0.95,
        unit="",
        why="of a free time history's mean square; with more in its mean it never changes, takes no "
        "named cause's place and is told beside one only if it explains something else: forces that the "
        "catalogue lacks had 0.87 at most, what imitates a tilt or a mass 0.98",
    )
    beside_unknown_share: float = setting(
        0.1,
        unit="",
        why="of what a free time history explains, that a cause named beside it must add: it is never whole",
    )
    unexplained_scale: float = setting(2.4, unit="", why="model errors of sound recordings stay below it")
    rival_margin: float = setting(
        4.0, unit="nats", least=0.0, why="of log evidence, within which two causes are not told apart"
    )
    rival_share: float = setting(
        0.03,
        unit="",
        least=0.0,
        why="of the gain, likewise: what the model gets wrong grows with what a cause explains",
    )
    step_rest_share: float = setting(
        0.02,
        unit="",
        least=0.0,
        why="of the gain of a step beside the plates, that later causes must gain beyond the rest: its force "
        "and its place are free, while a contact has one point and leaves `rival_share`",
    )
    confidence_temper: float = setting(
        3.0, unit="nats", why="evidence is overconfident where the model is wrong"
    )
    temper_share: float = setting(
        0.03,
        unit="",
        least=0.0,
        why="of what a name explains, likewise. On a draw of edited recordings right names need 0.02 at most "
        "(a harness, while somebody stands), and a name that was rightly given up 0.11; other draws judge "
        "(benchmarks/FAULTS.md)",
    )
    outside_odds: float = setting(
        0.2,
        unit="",
        why="how likely a fault is on no list, before the balance: of real recordings whose fault was found "
        "by other means, too few are counted yet to say more",
    )
    sure_beside_unexplained: float = setting(
        0.9,
        unit="",
        why="of a name at most while something else stays unexplained, which it may stand in for: "
        "a plate in pounds beside a harness, in a real recording, was held for certain",
    )
    std_inflation: float = setting(1.3, unit="", why="by calibration on hidden effects")
    certain_gain: float = setting(
        40.0,
        unit="nats",
        why="from which on something is wrong even if several causes would do",
    )
    sure_margin: float = setting(
        100.0,
        unit="nats",
        why="a cause so far ahead of all others stays even if it needs another mass: that may be wrong too",
    )
    least_confidence: float = setting(
        0.2, unit="", why="of a smaller gain; model errors of real recordings suit many causes equally badly"
    )
    least_for_a_name: float = setting(
        0.5,
        unit="",
        why="of confidence, with names of the same trace: what is likelier wrong than right is told "
        "as a tentative cause",
    )
    same_trace: float = setting(
        0.9, unit="", why="cosine of what two causes explain, from which on they are told as one class"
    )
    other_trace: float = setting(
        0.15, unit="", why="likewise, up to which two causes explain different things and are no rivals"
    )
    undone: float = setting(
        0.7,
        unit="",
        why="cosine, turned round, of what a cause explains and what the others do: beyond it two large "
        "causes that are hardly there explain a small one that is not known",
    )
    least_unknown_share: float = setting(0.012, unit="BW", why="a force below it nobody would look for")
    tolerated_share: float = setting(
        0.05, unit="", why="of what named causes took away; a contact is never described to the last newton"
    )
