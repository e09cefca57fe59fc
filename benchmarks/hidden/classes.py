"""The names that an answer may give, each with its family and one sentence."""

from dataclasses import dataclass

NONE, SOMETHING_ELSE = "none", "something_else"


@dataclass(frozen=True)
class Cause:
    """What an answer may name."""

    family: str
    sentence: str


CAUSES = {
    NONE: Cause("none", "nothing is wrong beyond noise, soft tissue and an ordinary model"),
    SOMETHING_ELSE: Cause("something else", "something is wrong that is not in this list"),
    "clock_offset": Cause("time", "forces recorded late or early against the markers"),
    "sample_rate": Cause("time", "the forces' rate is wrong: they are stretched in time"),
    "filter_mismatch": Cause("time", "forces low-passed far below what the motion holds"),
    "plate_gain": Cause("plate", "one plate reads a wrong multiple"),
    "plate_bias": Cause("plate", "one plate reads a constant force too much"),
    "plate_position": Cause("plate", "one plate lies elsewhere than the file says"),
    "plate_yaw": Cause("plate", "one plate is turned about the vertical"),
    "plate_swap": Cause("plate", "two plates' columns are exchanged"),
    "axis_convention": Cause("plate", "a horizontal axis has the wrong sign, or two are exchanged"),
    "gravity_tilt": Cause("plate", "the plates' vertical is tilted against gravity"),
    "off_plate_step": Cause("ground", "a step that no plate recorded"),
    "belt_acceleration": Cause("ground", "the belt or platform accelerates"),
    "external_contact": Cause("person", "something touches a segment for part of the trial"),
    "body_weight_support": Cause("person", "a constant upward force on the trunk or pelvis"),
    "elastic_tether": Cause("person", "an elastic band from a fixed point to the trunk or pelvis"),
    "drag": Cause("person", "a force against the velocity of the trunk or pelvis"),
    "carried_mass": Cause("person", "a load on a segment"),
    "subject_mass": Cause("body", "the entered mass of the person is wrong"),
    "segment_mass": Cause("body", "segments weigh otherwise than in the model"),
    "wobbling_mass": Cause("body", "a share of the trunk swings on a spring"),
    "marker_slip": Cause("markers", "one marker moves on its segment at some instant"),
    "marker_swap": Cause("markers", "two markers' labels are exchanged for a while"),
    "capture_scale": Cause("markers", "the cameras' length scale is wrong"),
    "soft_tissue": Cause("markers", "one segment's markers slide with the joint's angle, more than usual"),
}
