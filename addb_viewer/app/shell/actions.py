"""What keys, buttons and lists of one browser do."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import viser

from addb_viewer.app.page.handles import put
from addb_viewer.app.review.review_panel import SUGGESTION
from addb_viewer.app.scene import camera
from addb_viewer.app.scene.camera import VIEWS, eye_of
from addb_viewer.app.scene.measuring import HOW
from addb_viewer.app.shell import keys
from addb_viewer.app.shell.capturing import Capturing
from addb_viewer.app.shell.commands import COMMANDS, Command
from addb_viewer.app.shell.controls import SAVE
from addb_viewer.app.shell.keys import Action
from addb_viewer.app.shell.session import Session
from addb_viewer.trial_view.frame_ranges import Stop
from addb_viewer.trial_view.recorded_subject import ON_ONE_PAGE
from addb_viewer.trial_view.worst_frame import worst_frame
from annotations.events import Status
from annotations.reasons import REASON_KEYS, reason_named
from annotations.review_errors import ReviewError
from solver.fitting.results.extension_log import ACCEPT, REJECT

LARGEST_PX = 1e5  # of a picture that a page tells
FINISHING = ("finish", "finish_sure")  # the only keys after which nobody has looked at what they brought


@dataclass(frozen=True)
class GoTo:
    """A frame."""

    frame: int


@dataclass(frozen=True)
class Select:
    """Frames start to end − 1."""

    start: int
    end: int


@dataclass(frozen=True)
class OpenRow:
    """A row of the queue, from 0."""

    row: int


@dataclass(frozen=True)
class Drop:
    """Nothing is to be selected any more."""


Entry = GoTo | Select | OpenRow | Drop


def entry(text: str) -> Entry | None:
    """What a text in the box asks for; None while it is not, or not yet, whole."""
    text = text.strip()
    if match := re.fullmatch(r"(\d{1,9})", text):
        return GoTo(int(match[1]))
    if match := re.fullmatch(r"(\d{1,9})\s*([-–:])\s*(\d{1,9})", text):
        start, last = int(match[1]), int(match[3])
        end = last if match[2] == ":" else last + 1  # a colon is that of the command line
        return Select(start, end) if start < end else None
    if match := re.fullmatch(r"#(\d{1,9})", text):
        return OpenRow(int(match[1]))
    if text == "-":
        return Drop()
    return None


def listen(s: Session) -> None:
    """Obey what is clicked and dragged on the page's own parts."""

    def went(text: Any) -> None:
        if isinstance(text, str):
            s.notices.obey("Going there", lambda: go_to(s, text))

    def moved(border: Any) -> None:
        match border:
            case {"start": int(start), "end": int(end), "foot": str() | None as foot, "to": [int(a), int(b)]}:
                flag = (start, end, foot)
                s.notices.obey("Moving the border", lambda: _move_border(s, flag, (a, b)))

    def chosen(block: Any) -> None:
        match block:
            case {"start": int(start), "end": int(end), "foot": str() | None as foot} if 0 <= start < end:
                s.notices.obey("Selecting", lambda: s.review.go_to((start, end, foot)))

    def resized(size: Any) -> None:
        match size:
            case [int() | float() as width, int() | float() as height] if s.picture != (width, height):
                if 0 < width < LARGEST_PX and 0 < height < LARGEST_PX:
                    s.picture = (width, height)
                    s.playback.redraw()

    s.channel.on("picture", resized)
    s.channel.on("go_to", went)
    s.channel.on("select", chosen)
    s.channel.on("border", moved)


def _move_border(s: Session, flag: Stop, to: tuple[int, int]) -> None:
    if s.replay is not None and 0 <= to[0] < to[1] <= s.replay.frames:
        s.review.move_border(flag, to)


def go_to(s: Session, text: str) -> None:
    """Do what was clicked, or written into the box; while it is not whole, nothing."""
    match entry(text):
        case GoTo(frame):
            s.review.drop(only_whole=True)
            s.seek(frame)
        case Drop():
            s.review.drop(only_whole=True)
        case Select(start, end):
            s.review.select(start, end)
            s.review.warm_up()
        case OpenRow(row):
            s.questions.no()
            s.queue.open_row(row)


def connect(session: Session, commands: Sequence[Command]) -> None:
    """Let the keys, and the panels' handles, act.

    Args:
        session: of the browser.
        commands: with their keys.
    """
    s, capturing = session, Capturing(session)
    help_page = keys.page_html(commands, str(keys.key_file()))
    s.keys_page.content = help_page
    actions = {
        **{
            name: act if name in FINISHING or name in keys.ANSWERS else _then(s.finishing.look, act)
            for name, act in actions_of(s).items()
        },
        "picture": capturing.picture,
        "film": capturing.film,
        "help": lambda: _toggle_help(s, help_page),
    }
    _bind_buttons(s, actions)
    _bind_fields(s)
    listen(s)
    s.channel.on("point", partial(_point, s))
    s.channel.on("dark", lambda dark: s.system_turned(dark is True))
    s.channel.on("pick", lambda place: s.notices.obey("Measuring", partial(_pick, s, place)))
    keys.register(s.client.gui, s.channel, commands, keys.Acting(actions, s.notices, s.questions))


def actions_of(session: Session) -> Mapping[str, Action]:
    """One for each command of `COMMANDS` but the help and what saves the scene."""
    s, review, solving = session, session.review, session.solving
    return {
        **moves_of(session),
        "range_start": _then(review.range_start, review.warm_up),
        "range_end": _then(review.range_end, review.warm_up),
        **{f"flag_{key}": partial(review.paint, key) for key in (*(k.key for k in REASON_KEYS), "0")},
        "foot": review.next_foot,
        "next": review.steps.on,
        "previous": review.steps.back,
        "accept_proposal": lambda: _decide(s, ACCEPT, review.steps.accept),
        "reject_proposal": lambda: _decide(s, REJECT, review.steps.reject),
        "undo": s.finishing.undo,
        "redo": review.redo,
        "what_if": review.what_if,
        "activity": review.activities.label_whole,
        "second_look": partial(review.set_status, Status.SECOND_LOOK),
        "solve": solving.solve,
        "compare": _then(solving.toggle, s.compare_changed),
        "keep": solving.keep,
        "discard": solving.discard,
        "cancel": solving.cancel,
        "finish": s.finishing.finish,
        "finish_sure": s.finishing.finish_sure,
        "report": partial(s.recording.write, ".html"),
        "report_one_page": partial(s.recording.write, ON_ONE_PAGE),
        "record_rrd": partial(s.recording.write, ".rrd"),
        "record_mcap": partial(s.recording.write, ".mcap"),
        "curves_csv": s.curves.write,
        "diagnose": s.diagnosis.diagnose_or_show,
        "accept": s.diagnosis.accept,
        "reject": s.diagnosis.reject,
        **{f"view_{name.lower()}": partial(s.view, name) for name in VIEWS},
        "view_person": partial(_fit_view, s),
        "yes": partial(_yes, s),
        "no": partial(_escape, s),
        "measure": lambda: _measure(s, not s.scene.measuring.on),
        "rename": s.reviewer.ask,
        "trials": s.queue.choose,
        "fit_all": s.queue.fit_unfitted,
        "cancel_fits": s.trials.cancel_fits,
        "go_to": partial(_go_to_typed, s),
        "show_diagnosis": s.diagnosis.point_out,
        "diagnose_anew": s.diagnosis.diagnose,
        "unusable": s.finishing.mark_unusable,
        "theme": lambda: s.set_dark(not s.memory.dark),
    }


def moves_of(session: Session) -> Mapping[str, Action]:
    """What moves the cursor."""
    p = session.playback
    return {
        "toggle": p.toggle,
        **{c.action: partial(p.step, c.step_frames) for c in COMMANDS if c.step_frames},
        **{c.action: partial(p.step_seconds, c.step_s) for c in COMMANDS if c.step_s},
        "first": lambda: p.seek(0),
        "last": lambda: p.seek(p.frames - 1),
        "worst": partial(_worst, session),
        "worst_marker": partial(_worst_marker, session),
        "loop": partial(_loop, session),
        "slower": p.slower,
        "stop": p.pause,
        "faster": p.faster,
    }


def _bind_buttons(s: Session, actions: Mapping[str, Action]) -> None:
    """Those that do what a command does, and those that no command stands for."""
    c, review, solving, in_order = s.controls, s.review, s.solving.panel, s.notices.in_order
    panel = review.panel
    views = {name: f"view_{name.lower()}" for name in VIEWS}
    for group, doing, names in (
        (c.show.view, "Turning the camera", views),
        (c.show.save, "Saving", SAVE),
    ):
        _bind_group(s, group, doing, {label: actions[action] for label, action in names.items()})
    suggestion = dict(zip(SUGGESTION, (review.activities.confirm, review.activities.refuse), strict=True))
    _bind_group(s, panel.suggestion, "Labelling", suggestion)
    for button, doing, act in (
        (panel.paint, "Flagging", lambda: review.flag(reason_named(str(panel.reason.value)))),
        (panel.label, "Labelling", review.activities.label),
        (panel.comments.say, "Commenting", review.comments.say),
        (panel.comments.settle, "Settling the comment", review.comments.settle),
        (panel.rename, "Changing your name", actions["rename"]),
        (solving.solve, "Solving", actions["solve"]),
        (solving.keep, "Keeping", actions["keep"]),
        (solving.discard, "Discarding", actions["discard"]),
    ):
        button.on_click(in_order(doing, act))


def _bind_fields(s: Session) -> None:
    c, solving = s.controls, s.solving
    compare = solving.panel.compare
    fields: list[tuple[viser.GuiInputHandle[Any], str, Action]] = [
        *((switch, "Showing", partial(_show_options, s)) for switch in c.show.switches.values()),
        (c.show.follow, "Following", partial(_follow, s)),
        (c.show.measure, "Measuring", lambda: _measure(s, c.show.measure.value)),
        (c.show.dark, "Turning the theme", lambda: s.set_dark(c.show.dark.value)),
        (compare, "Comparing", _then(lambda: solving.compare(compare.value), s.compare_changed)),
        (solving.panel.other, "Comparing", solving.choose),
    ]
    for field, doing, act in fields:
        field.on_update(s.notices.in_order(doing, act))


def _bind_group(
    s: Session, group: viser.GuiButtonGroupHandle, doing: str, actions: Mapping[str, Action]
) -> None:
    async def clicked(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        s.notices.do(doing, actions[event.target.value])

    group.on_click(clicked)


def _escape(s: Session) -> None:
    """Esc: no to the question; where none is asked, the selection and what was told of failures go."""
    if s.questions.waits:
        s.questions.no()
    elif s.replay is not None and s.scene.measuring.on:
        _measure(s, False)
    else:
        s.notices.dismiss()
        s.review.drop()


def _yes(s: Session) -> None:
    """Y: yes to the question; where none is asked, the new solve is kept, or discarded where it is worse."""
    if s.questions.waits:
        s.questions.yes()
    elif s.shared.fits.new is not None:
        s.solving.decide()
    else:
        raise ReviewError("nothing is asked, and no new solve waits")


def _toggle_help(s: Session, page: str) -> None:
    """?: the keys, until ? or Esc."""
    if s.questions.waits:
        s.questions.no()
    else:
        s.questions.show("Keys", page)


def _worst(s: Session) -> None:
    """W: to the frame with the largest residual of those that the figures count."""
    replay = s.replay
    if replay is None or replay.residual is None:
        raise ReviewError("this needs a fit with forces; G solves")
    if not replay.residual.used.any():
        raise ReviewError("no frame of this trial counts: a force is missing or left out on each of them")
    frame, words = worst_frame(replay.residual)
    s.review.drop(only_whole=True)
    s.seek(frame)
    s.notices.tell("Worst frame that counts", words)


def _worst_marker(s: Session) -> None:
    """To the frame on which a marker is farthest from the model's."""
    replay = s.replay
    errors = None if replay is None else replay.markers.errors
    if replay is None or errors is None or not np.isfinite(errors).any():
        raise ReviewError("no marker of this trial is compared with the model's; G solves")
    frame, marker = np.unravel_index(np.nanargmax(errors), errors.shape)
    s.review.drop(only_whole=True)
    s.seek(int(frame))
    s.notices.tell(
        "Worst marker",
        f"{replay.markers.names[marker]}: {100 * errors[frame, marker]:.1f} cm at frame {frame}.",
    )


def _go_to_typed(s: Session) -> None:
    """A frame, or frames to select, that are typed."""

    def typed(text: str) -> None:
        if entry(text) is None or isinstance(entry(text), OpenRow):
            raise ReviewError("write a frame, as 57, or frames to select, as 120-179")
        go_to(s, text)

    s.questions.ask_text("Go to", "A frame, as 57, or frames to select, as 120-179", "", {"Go there": typed})


def _loop(s: Session) -> None:
    """Shift Space: the selected range again and again; once more, and it stops."""
    chosen = s.review.chosen
    if chosen is None or not s.review.selection.is_whole:
        raise ReviewError("select a range first: I and O, N, or drag over the timeline")
    s.playback.loop(*chosen)


def _fit_view(s: Session) -> None:
    """V: the whole person in the picture, from the side that the camera is on."""
    if s.replay is not None and not camera.fit(s.client, s.scene.extent(s.frame)):
        raise ReviewError(f"nobody is seen on frame {s.frame}; go to another one")


def _measure(s: Session, on: bool) -> None:
    """D: clicks in the scene measure from now on, or no longer."""
    if s.replay is None:
        return
    s.scene.measuring.switch(on)
    put(s.controls.show.measure, on)
    s.channel.show("measuring", on)
    s.playback.redraw()


def _pick(s: Session, place: Any) -> None:
    """A click in the scene while it is measured in."""
    match place:
        case [int() | float() as x, int() | float() as y] if s.replay is not None and s.scene.measuring.on:
            eye = eye_of(s.client.camera, s.picture)
            if s.scene.measure(s.frame, eye, np.array([x, y], dtype=float)):
                s.playback.redraw()
            else:
                s.notices.tell("Nothing is there", HOW)


def _point(s: Session, place: Any) -> None:
    """The pointer rests in the scene."""
    match place:
        case [int() | float() as x, int() | float() as y, int(number)] if s.replay is not None:
            eye = eye_of(s.client.camera, s.picture)
            words = s.scene.pointed_at(s.frame, eye, np.array([x, y], dtype=float))
            s.channel.show("pointed", [words, number])


def _decide(s: Session, kind: str, proposal: Action) -> None:
    """About the proposal at hand; where there is none, about the cause that X has shown."""
    cause = s.diagnosis.asked_about if s.review.current is None else None
    if cause is None:
        proposal()
    else:
        s.diagnosis.decide_one(kind, cause)


def _show_options(s: Session) -> None:
    show = s.controls.show
    for option, switch in show.switches.items():
        setattr(s.scene.options, option, switch.value)
    show.legend.content = s.scene.legend
    s.playback.redraw()


def _follow(s: Session) -> None:
    s.scene.follow(s.controls.show.follow.value, s.frame)
    s.playback.redraw()


def _then(first: Action, second: Action) -> Action:
    def both() -> None:
        first()
        second()

    return both
