"""What a rerun recording opens on: the scene above its lanes; beside them curves, figures and log."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from addb_viewer.recordings.rrd_log import LANES, LOG, REPORT, SECONDS, SOLVER, SOLVER_STEP, SUMMARY
from addb_viewer.recordings.rrd_scene import BEFORE, SCENE
from addb_viewer.recordings.rrd_series import (
    ANALOG,
    FORCE,
    MARKERS,
    MOMENT,
    SERIES,
    VERTICAL,
    joint_parts,
    joint_quantities,
)
from addb_viewer.recordings.rrd_stream import TIME, path
from addb_viewer.trial_view.joint_quantities import SAGITTAL, Kind
from addb_viewer.trial_view.recorded_subject import TrialRecord
from addb_viewer.trial_view.replay import JointReplay, Replay

CURVES = {  # by panel; legends would hide the curves, so the titles say what is what
    FORCE: "Residual force [N]: fit red, {before}bound grey",
    MOMENT: "Residual moment [N·m]: fit red, {before}bound grey",
    MARKERS: "Marker error [cm]: RMS blue, {before}largest and bound grey",
    VERTICAL: "Vertical force of each plate [N]",
}
BACKGROUND = (38, 42, 48)  # bones, markers and arrows stand out from it in a light and in a dark window
TOWARDS_EYE = (0.72, 0.12, 0.68)  # from the person: to the right, up, ahead
NEAREST_M, PER_METRE = 2.3, 0.25  # of the eye, and how much farther for each metre that the person covers


def blueprint_of(record: TrialRecord, *, several: bool) -> rrb.Blueprint:
    """The layout for a trial.

    Args:
        record: the trial.
        several: the file has other trials too, so their list is open.
    """
    together = rrb.TimeAxis(link="LinkToGlobal")
    replay, before = record.replay, f"{record.before_name} sky blue, " if record.before is not None else ""
    curves = [
        rrb.TimeSeriesView(
            origin=path((SERIES, panel)),
            name=name.format(before=before),
            plot_legend=rrb.PlotLegend(visible=False),
            axis_x=together,
        )
        for panel, name in CURVES.items()
    ]
    shown: rrb.Vertical | rrb.Tabs = rrb.Vertical(*curves, name="Forces and errors")
    behind: list[rrb.View | rrb.Vertical] = []
    if replay.joints is not None:
        behind.append(rrb.Vertical(*_joints(replay.joints, together), name="Joints"))
    if record.analog[0] is not None:
        behind.append(rrb.TimeSeriesView(origin=path((SERIES, ANALOG)), name="Analog", axis_x=together))
    if behind:
        shown = rrb.Tabs(shown, *behind, active_tab=0)
    words = rrb.Tabs(
        rrb.TextDocumentView(origin=path((SUMMARY,)), name="Figures"),
        rrb.TextLogView(
            origin=path((LOG,)),
            name="Log",
            columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"]),
        ),
        rrb.DataframeView(
            origin=path((SOLVER,)),
            contents=[f"+ {path((SOLVER, name))}" for name in (REPORT, SECONDS)],
            name="Solver",
            query=rrb.archetypes.DataframeQuery(timeline=SOLVER_STEP),
        ),
        active_tab=0,
    )
    scenes = [_scene(replay, "Scene", but=BEFORE), _scene(replay, "Before and after")]
    lanes = rrb.StateTimelineView(origin=path((LANES,)), name="Flags and causes", time_view=together)
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(rrb.Tabs(*scenes, active_tab=0), lanes, row_shares=[5, 3]),
            rrb.Vertical(shown, words, row_shares=[8, 2]),
            column_shares=[3, 2],
        ),
        rrb.BlueprintPanel(state="expanded" if several else "hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=TIME, loop_mode="all"),
    )


def _joints(joints: JointReplay, together: rrb.TimeAxis) -> list[rrb.TimeSeriesView]:
    """Angles and torques of hip, knee and ankle, where the model has these; others can be added."""
    views = []
    for kind, name in ((Kind.POSITION, "Joint angles [°]"), (Kind.TORQUE, "Joint torques [N·m]")):
        own = [quantity for quantity in joint_quantities(joints) if quantity.kind is kind]
        main = [quantity for quantity in own if quantity.stem in SAGITTAL] or own
        if main:
            contents = [f"+ {path(joint_parts(quantity))}" for quantity in main]
            views.append(rrb.TimeSeriesView(origin="/", contents=contents, name=name, axis_x=together))
    return views


def _scene(replay: Replay, name: str, but: str | None = None) -> rrb.Spatial3DView:
    contents = [f"+ {path((SCENE,))}/**"]
    if but is not None:
        contents.append(f"- {path((SCENE, but))}/**")
    return rrb.Spatial3DView(
        origin="/",
        contents=contents,
        name=name,
        background=list(BACKGROUND),
        line_grid=rrb.LineGrid3D(visible=True, plane=rr.components.Plane3D([0.0, 1.0, 0.0], 0.0)),
        eye_controls=_eye(replay),
    )


def _eye(replay: Replay) -> rrb.EyeControls3D | None:
    """From the person's right front, so far away that the whole path is in view."""
    bodies = replay.bodies
    if bodies is None:
        return None
    root = bodies.position[:, bodies.root]
    known = np.flatnonzero(np.isfinite(root).all(axis=1))
    if not len(known):
        return None
    up = np.array([0.0, 1.0, 0.0])
    ahead = np.array([1.0, 0.0, 0.0]) if bodies.forward is None else bodies.forward[known[0]] * (1.0 - up)
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
    low, high = root[known].min(axis=0), root[known].max(axis=0)
    distance = NEAREST_M + PER_METRE * float(np.linalg.norm(high - low))
    direction = np.stack([np.cross(ahead, up), up, ahead], axis=1) @ np.array(TOWARDS_EYE)
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=(low + high) / 2 + distance * direction,
        look_target=(low + high) / 2,
        eye_up=up,
    )
