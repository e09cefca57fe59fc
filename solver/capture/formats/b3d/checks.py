"""Whether a trial's series have the sizes that the header speaks of."""

from collections.abc import Iterator

from solver.capture.formats.b3d.frames import present
from solver.capture.formats.b3d.schema import B3dTrial, Header, PassFrames, SensorFrames

_BY_DOF = ("pos", "vel", "acc", "tau")
_BY_BODY_6 = ("ground_contact_wrench", "root_frame_ground_contact_wrench")
_BY_BODY_3 = (
    "ground_contact_center_of_pressure",
    "ground_contact_torque",
    "ground_contact_force",
    "root_frame_ground_contact_center_of_pressure",
    "root_frame_ground_contact_torques",
    "root_frame_ground_contact_force",
)
_POINTS = ("com_pos", "com_vel", "com_acc", "root_frame_com_acc")
_TWISTS = ("root_frame_residual", "root_frame_spatial_velocity", "root_frame_spatial_acceleration")
_BY_JOINT = ("root_frame_joint_centers", "world_frame_joint_centers")


def faults(header: Header, trial: B3dTrial) -> Iterator[str]:
    """What does not fit together, in words, one thing at a time."""
    about = trial.header
    for name in ("missing_GRF_reason", "has_manual_GRF_annotation"):
        stated = len(getattr(about, name))
        if stated not in (0, about.trial_length):
            yield f"{name} has {stated} values for {about.trial_length} frames"
    if len(trial.passes) != len(about.processing_pass_header):
        yield f"{len(trial.passes)} passes, but headers for {len(about.processing_pass_header)}"
    yield from _faults_of_series(trial.sensors, about.trial_length, _sensor_widths(header))
    for frames in trial.passes:
        yield from _faults_of_series(frames, about.trial_length, _pass_widths(header))


def _faults_of_series(
    series: SensorFrames | PassFrames, frames: int, widths: dict[str, tuple[int, str]]
) -> Iterator[str]:
    for name, array in present(series).items():
        if len(array) != frames:
            yield f"{name} has {len(array)} frames instead of {frames}"
        width, reason = widths.get(name, (array.shape[1], ""))
        if array.shape[1] != width:
            yield f"{name} has {array.shape[1]} numbers a frame, but {reason} ask for {width}"


def _sensor_widths(header: Header) -> dict[str, tuple[int, str]]:
    return {
        "marker_obs": (3 * len(header.marker_name), f"{len(header.marker_name)} marker names"),
        "acc_obs": (3 * len(header.acc_name), f"{len(header.acc_name)} accelerometers"),
        "gyro_obs": (3 * len(header.gyro_name), f"{len(header.gyro_name)} gyroscopes"),
    }


def _pass_widths(header: Header) -> dict[str, tuple[int, str]]:
    bodies, dofs, joints = len(header.ground_contact_body), header.num_dofs, header.num_joints
    widths = dict.fromkeys(_BY_DOF, (dofs, f"{dofs} degrees of freedom"))
    widths |= dict.fromkeys(_BY_BODY_6, (6 * bodies, f"{bodies} contact bodies"))
    widths |= dict.fromkeys(_BY_BODY_3, (3 * bodies, f"{bodies} contact bodies"))
    widths |= dict.fromkeys(_POINTS, (3, "points"))
    widths |= dict.fromkeys(_TWISTS, (6, "wrenches and twists"))
    if joints:
        widths |= dict.fromkeys(_BY_JOINT, (3 * joints, f"{joints} joints"))
    return widths
