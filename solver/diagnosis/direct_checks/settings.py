"""Settings of the direct checks: what sound recordings show, and how large faults are, each with its reason.

Scatter of sound recordings is remade by `benchmarks.sound_recordings`, of all people whose recordings are
sound, those in folders as laboratories left them too; each counts once.
"""

from dataclasses import dataclass

from solver.capture.plates.loads_under_feet import UnderFeetSettings
from solver.capture.subject.body_lengths import BodyLengthSettings
from solver.common.plate_figures import CONTACT_N
from solver.common.settings_field import setting


@dataclass(frozen=True)
class DirectCheckSettings:
    """What the direct checks know beforehand."""

    told_nats: float = setting(
        5.0,
        unit="nats",
        why="150 to 1: what a direct check says for a class is told from here on; each trial has ten figures",
    )
    suspecting_nats: float = setting(
        6.0,
        unit="nats",
        why="400 to 1: from here on nothing else is named; a plate that is 19 cm off has as much",
    )
    refuting_nats: float = setting(
        10.0,
        unit="nats",
        why="20 000 to 1: what a cause says of a plate's scale is refuted by what the plate carries in sound "
        "steps; one step that carries the entered mass has 13 against half or double",
    )
    window_s: float = setting(
        0.12, unit="s", why="smoothing that heights and forces share: a quarter of a step's bounce"
    )
    loaded_N: float = setting(CONTACT_N, unit="N", why="gait laboratories' contact threshold")
    missing_share: float = setting(
        0.25,
        unit="",
        why="of what weight and motion ask for: where more is missing, a foot is beside the plates",
    )
    fewest_s: float = setting(0.5, unit="s", why="of frames that count: half a step tells no weight")
    least_asked_share: float = setting(
        0.3,
        unit="",
        why="of gravity, that the motion asks for on average while plates bear: stances of walks and runs "
        "ask for all of it and more; forces a tenth of a second late fall into flight",
    )
    least_agreement: float = setting(
        0.9, unit="", why="correlation of force and motion, from which on a lag means something"
    )
    mass_scatter: float = setting(
        0.024,
        unit="",
        why="of the mass that forces carry about the one that laboratories state: clothes, scales",
    )
    mass_usual: float = setting(0.12, unit="", why="loads of 8 kg; another person's mass")
    alone_s: float = setting(0.15, unit="s", why="that a plate bears alone, of a walk or a run")
    plates_scatter: float = setting(
        0.03, unit="", why="between plates, of the mass that each carries alone; legs differ"
    )
    trial_mass_scatter: float = setting(0.015, unit="", why="between trials of one person")
    lag_bias_s: float = setting(
        -0.004,
        unit="s",
        least=-0.1,
        why="of the method: soft tissue lags behind the bones that the forces move",
    )
    lag_scatter_s: float = setting(0.006, unit="s", why="-9, -4, -3 ms in three sound walks of three people")
    lag_usual_s: float = setting(0.03, unit="s", why="a trigger line, a filter's delay, a hand-set start")
    trial_lag_scatter_s: float = setting(0.004, unit="s", why="between trials of one person")
    standing_share: float = setting(0.6, unit="", why="of body weight: in walking the plates bear more")
    edge_s: float = setting(0.14, unit="s", why="double support: how long a weight passes to the next foot")
    most_lag_s: float = setting(0.2, unit="s", why="farther off, another step would fit as well")
    foot_height_m: float = setting(
        UnderFeetSettings.foot_height_m, unit="m", why="markers that come so near the lowest are on feet"
    )
    foot_length_m: float = setting(
        UnderFeetSettings.foot_length_m, unit="m", why="markers that are farther apart are on two feet"
    )
    foot_rigid_m: float = setting(
        0.015, unit="m", why="by which distances on a foot scatter, toes that bend included"
    )
    pressing_m: float = setting(
        0.015, unit="m", why="a marker so much above its own lowest bears a third of what it bears there"
    )
    loaded_share: float = setting(0.3, unit="", why="of a plate's largest load; below, pressures are noise")
    path_scatter_m: float = setting(
        0.03, unit="m", why="of the pressure about the foot's pressing markers, as in eight sound stances"
    )
    path_worth: float = setting(3.0, unit="", why="independent places of one stance: heel, middle, toes")
    place_scatter_m: float = setting(
        0.02,
        unit="m",
        why="of the middle of all stances, each way: shoes, and markers on one side of the foot",
    )
    place_usual_m: float = setting(0.15, unit="m", why="a plate entered at the wrong place")
    standing_scatter_m: float = setting(
        0.04, unit="m", why="of the point about which a standing foot's load changes: heel to ball"
    )
    empty_scatter_N: float = setting(4.0, unit="N", why="what a tare leaves, and ringing of filters")
    empty_usual_N: float = setting(
        30.0, unit="N", why="untared plates; larger levels are taken off and told when files are read"
    )
    exchange_scatter: float = setting(
        0.05, unit="", why="logarithm of what one plate gains over what the other loses"
    )
    exchange_usual: float = setting(0.7, unit="", why="half or double gain; pounds are 1.5")
    standing_s: float = setting(1.0, unit="s", why="on two plates, for an exchange between them")
    rigid_m: float = setting(
        BodyLengthSettings.rigid_m,
        unit="m",
        why="by which distances on a segment scatter with soft tissue; joints let them vary more",
    )
    near_m: float = setting(0.3, unit="m", why="farther markers are on other segments")
    step_m: float = setting(
        0.008, unit="m", why="change of such a distance at one moment that is worth a word"
    )
    step_scatter_m: float = setting(
        0.005,
        unit="m",
        why="13 mm at most, of soft tissue at a strike and of thighs, on the people who set this",
    )
    step_usual_m: float = setting(0.03, unit="m", why="a marker knocked off and put back elsewhere")


DIRECT_CHECKES = DirectCheckSettings()
