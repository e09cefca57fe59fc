"""The timeline of one browser: its lanes, its charts, and what is chosen for it."""

from typing import TYPE_CHECKING

import numpy as np
import viser

from addb_viewer.app.shell.controls import NO_JOINT, PAGES_S, build_timeline_controls
from addb_viewer.app.shell.layout import Layout
from addb_viewer.app.timeline.charts import charts_of, joint_choices
from addb_viewer.app.timeline.lanes import lanes_of
from addb_viewer.app.timeline.timeline import Timeline
from annotations.events import Status
from annotations.trial_review import TrialReview
from solver.runs import runs

if TYPE_CHECKING:
    from addb_viewer.app.shell.session import Session

JOINTS = 2  # that can be charted at once


class TimelineDesk:
    """What one reviewer sees over time."""

    def __init__(
        self, gui: viser.GuiApi, tab: viser.GuiTabHandle, session: "Session", layout: Layout
    ) -> None:
        self.session = session
        self.drawn = Timeline(gui, tab, layout.chart_height)
        with tab:
            self.controls = build_timeline_controls(gui, JOINTS)
        for handle in self.controls.joints:
            handle.on_update(session.notices.in_order("Charting", self.show))
        self.controls.page.on_update(session.notices.in_order("Zooming", self._zoom))

    def show(self) -> None:
        """Draw the trial that is on the screen."""
        replay = self.session.replay
        if replay is None:
            return
        names = () if replay.joints is None else tuple(joint_choices(replay.joints))
        for handle in self.controls.joints:
            if handle.options != (NO_JOINT, *names):
                handle.options = (NO_JOINT, *names)
        chosen = tuple(str(handle.value) for handle in self.controls.joints)
        self.draw_lanes()
        self.drawn.show(replay.times, charts_of(replay, self.session.solving.other, chosen))
        self._zoom()

    def draw_lanes(self) -> None:
        """Draw what people and detection say."""
        session, replay = self.session, self.session.replay
        if replay is None:
            return
        review = session.review.review
        self.drawn.lanes(
            lanes_of(
                replay,
                review,
                reviewed=reviewed(review, replay.frames),
                proposals=session.review.proposals,
                current=session.review.current,
                figures=session.diagnosis.state.figures,
                suggested=session.review.suggested,
                chosen=session.review.chosen,
            )
        )
        self.drawn.select(session.review.chosen)

    def cursor(self, frame: int) -> None:
        """Move the cursor."""
        self.drawn.cursor(frame)

    def select(self, frames: tuple[int, int] | None) -> None:
        """Show which range keys act on."""
        self.drawn.select(frames)

    def _zoom(self) -> None:
        replay, seconds = self.session.replay, PAGES_S[str(self.controls.page.value)]
        if replay is not None:
            self.drawn.zoom(None if seconds is None else max(round(seconds * replay.rate), 2))


def reviewed(review: TrialReview, frames: int) -> tuple[tuple[int, int], ...]:
    """Ranges on which a person has decided about every foot; all frames of a finished trial."""
    if review.status is Status.FINISHED:
        return ((0, frames),)
    return tuple((int(start), int(end)) for start, end in runs(np.asarray(review.judged(frames).any(axis=1))))
