"""What counts as the right name of each kind of fault, and what as a name of its class.

Where no name is given, the loudest direct check tells the class, if it speaks for one.

A class holds what nobody could tell from the fault by this recording or would act on in the same way: the ids
of a branch of the catalogue. A cause that is added for one of these faults is added to what is right.
"""

from dataclasses import dataclass

from solver.diagnosis.causes.catalogue import ABOUT, MARKER_IDS


@dataclass(frozen=True)
class Names:
    """Ids that are right, ids of the class, and words of notes where reading corrects the fault."""

    right: tuple[str, ...]
    of_class: tuple[str, ...] = ()
    corrected: str = ""  # regular expression; {plate} is the plate's name in the files
    checked: tuple[str, ...] = ()  # classes that a direct check may speak for instead of a name


def _in_branch(trunk: str) -> tuple[str, ...]:
    return tuple(id for id, about in ABOUT.items() if about.branch.startswith(f"{trunk}/"))


OF_ALL_PLATES = ("gravity_tilt",)  # nobody could take it for a fault of one plate
PLATE = (*(id for id in _in_branch("plate") if id not in OF_ALL_PLATES), "plate_sign")
CLOCK = _in_branch("time")
WEIGHT = tuple(id for id, about in ABOUT.items() if about.weight)
MARKERS = MARKER_IDS
ZERO = "{plate}: its zero level is off.*; taken off"

GEOMETRY = ("plate_turned_or_mirrored", "plate_place")

NAMES = {
    "tared_under_load": Names(("zero_level", "plate_bias"), PLATE, ZERO),
    "zero_level": Names(("zero_level", "plate_bias"), PLATE, ZERO),
    "turned_half": Names(("plate_turn", "plate_yaw"), PLATE, checked=GEOMETRY),
    "turned_quarter": Names(("plate_turn", "plate_yaw"), PLATE, checked=GEOMETRY),
    "mirrored": Names(("plate_mirror",), PLATE, checked=GEOMETRY),
    "shifted": Names(("plate_position",), PLATE, checked=GEOMETRY),
    "pounds": Names(("plate_units", "plate_gain"), PLATE, checked=("plate_scale",)),
    "half_gain": Names(("plate_units", "plate_gain"), PLATE, checked=("plate_scale",)),
    "quarter_gain": Names(("plate_units", "plate_gain"), PLATE, checked=("plate_scale",)),
    "sign": Names(("plate_sign",), PLATE, "{plate}: forces point downwards.*sign is turned"),
    "exchanged_plates": Names(("plate_swap", "plate_exchange"), PLATE, checked=GEOMETRY),
    "late": Names(("clock_offset",), CLOCK),
    "two_lags": Names(("clock_offset", "trial_clocks"), CLOCK),
    "one_plate_late": Names(("plate_clock",), CLOCK),
    "drift": Names(("sample_rate",), CLOCK),
    "filtered": Names(("filter_mismatch",), CLOCK),
    "lost_step": Names(("off_plate_step",)),
    "object_on_plate": Names(("object_on_plate",), ("plate_bias", "zero_level", *WEIGHT), ZERO),
    "other_mass": Names(("subject_mass",), WEIGHT),
    "support": Names(("body_weight_support",), WEIGHT),
    "marker_slip": Names(("marker_slip",), MARKERS),
    "exchanged_labels": Names(("marker_swap",), MARKERS, "exchang|labels"),
    "cloth": Names(("soft_tissue", "segment_displaced"), MARKERS),
}
