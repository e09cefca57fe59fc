"""How the parameters of each cause are said: sense, unit and which sign means what."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Reading:
    """How one parameter is said: `{amount}`, `{signed}`, and `{which}` by its sign (above zero, below)."""

    parameter: str
    text: str
    unit: str
    factor: float = 1.0  # from the parameter's unit to `unit`
    zero: float = 0.0  # what no effect is
    which: tuple[str, str] | None = None


@dataclass(frozen=True)
class Place:
    """How three parameters that make one point are said together: `{distance}` and `{point}`."""

    parameters: str  # with {} for the axis
    text: str
    unit: str
    factor: float = 1.0
    unknown: str = ""  # said instead of a point whose spread is larger than its distance


def _along(
    parameters: str, text: str, unit: str, factor: float = 1.0, axes: str = "xyz"
) -> tuple[Reading, ...]:
    """One reading an axis, its sign told as the end of the axis that it points to."""
    return tuple(
        Reading(parameters.format(a), text.format(a), unit, factor, which=(f"+{a}", f"−{a}")) for a in axes
    )


NOT_TOLD = "this recording does not tell"
ON_SEGMENT = "{distance} from the segment's origin, at {point} in its axes"

READINGS: dict[str, tuple[Reading | Place, ...]] = {
    "clock_offset": (
        Reading("offset_s", "the forces come {amount} {which}", "ms", 1e3, which=("too late", "too early")),
    ),
    "sample_rate": (
        Reading("stretch", "their time axis is {amount} too {which}", "%", 1e2, which=("long", "short")),
        Reading(
            "stretch", "they come {amount} {which} with every second", "ms", 1e3, which=("later", "earlier")
        ),
    ),
    "filter_mismatch": (Reading("cutoff_Hz", "smoothed with a low-pass filter at {amount}", "Hz"),),
    "plate_gain": (
        Reading("gain_error", "it reads {amount} too {which}", "%", 1e2, which=("much", "little")),
    ),
    "plate_bias": (
        Reading(
            "bias_y_N",
            "it reads {amount} too {which} along y (bias {signed})",
            "N",
            which=("much", "little"),
        ),
        *_along("bias_{}_N", "it reads {{amount}} too far towards {{which}}", "N", axes="xz"),
        *_along("bias_{}_N_per_s", "drifting by {{amount}} towards {{which}}", "N/s"),
    ),
    "plate_position": _along(
        "shift_{}_m", "the files place it {{amount}} too far towards {{which}}", "mm", 1e3, axes="xz"
    ),
    "plate_yaw": (
        Reading(
            "yaw_deg",
            "what was recorded is turned by {amount} {which} about the plate's centre",
            "°",
            which=(
                "counter-clockwise, seen from above: turn its forces and centres of pressure back clockwise",
                "clockwise, seen from above: turn its forces and centres of pressure back counter-clockwise",
            ),
        ),
    ),
    "gravity_tilt": (
        Reading("tilt_x_deg", "the recorded forces are turned by {amount} about +x (right-hand rule)", "°"),
        Reading("tilt_z_deg", "the recorded forces are turned by {amount} about +z (right-hand rule)", "°"),
    ),
    "off_plate_step": (
        Reading("force_y_N", "the ground carries {amount} there on average", "N"),
        Reading("weight_share", "that is {amount} of body weight", "%", 1e2),
    ),
    "external_contact": (
        *_along("force_{}_N", "mean force on the person {{amount}} towards {{which}}", "N", axes="x"),
        Reading("force_y_N", "{amount} {which}", "N", which=("upwards", "downwards")),
        *_along("force_{}_N", "{{amount}} towards {{which}}", "N", axes="z"),
        Place("point_{}_m", f"it acts {ON_SEGMENT}", "mm", 1e3, f"where on the segment it acts, {NOT_TOLD}"),
    ),
    "body_weight_support": (Reading("force_N", "it lifts with {amount}", "N"),),
    "elastic_tether": (
        Reading("mean_force_N", "it pulls with {amount} on average", "N"),
        Reading("stiffness_N_per_m", "stiffness {amount}", "N/m"),
        Place("anchor_{}_m", "fixed in the room at {point}", "m", unknown=f"where it is fixed, {NOT_TOLD}"),
        Reading("rest_length_m", "slack below a length of {amount}", "m"),
    ),
    "drag": (
        Reading("mean_force_N", "it brakes with {amount} on average", "N"),
        Reading("b_Ns_per_m", "{amount} at 1 m/s", "N"),
        Reading("exponent", "growing with speed to the power of {amount}", ""),
    ),
    "belt_acceleration": (Reading("rms_m_per_s2", "{amount} (root mean square)", "m/s²"),),
    "carried_mass": (
        Reading("mass_kg", "it weighs {amount}", "kg"),
        Place(
            "offset_{}_m",
            f"its centre lies {ON_SEGMENT}",
            "mm",
            1e3,
            f"where on the segment it lies, {NOT_TOLD}",
        ),
    ),
    "subject_mass": (
        Reading(
            "mass_factor",
            "the person is {amount} {which} than entered",
            "%",
            1e2,
            zero=1.0,
            which=("heavier", "lighter"),
        ),
    ),
    "segment_mass": (
        Reading(
            "mass_factor",
            "{amount} {which} than in the model",
            "%",
            1e2,
            zero=1.0,
            which=("heavier", "lighter"),
        ),
    ),
    "wobbling_mass": (
        Reading("mass_kg", "{amount} swing", "kg"),
        Reading("frequency_Hz", "at {amount}", "Hz"),
        Reading("damping_ratio", "with a damping ratio of {amount}", ""),
    ),
    "marker_slip": (
        Reading("shift_m", "by {amount}", "mm", 1e3),
        Reading("time_s", "at {amount} from the trial's start", "s"),
    ),
    "capture_scale": (
        Reading(
            "scale",
            "markers lie {amount} too far {which}",
            "%",
            1e2,
            zero=1.0,
            which=("apart", "together"),
        ),
    ),
    "soft_tissue": (Reading("rms_m", "by {amount} (root mean square)", "mm", 1e3),),
}
