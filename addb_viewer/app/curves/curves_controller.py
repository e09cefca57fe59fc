"""The tab of curves of one browser: what is chosen there, and what the page draws of it."""

import re
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import viser

from addb_viewer.app.page.reviewer import BrowserMemory
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.subjects.library import Library
from addb_viewer.trial_view.analog_charts import analog_charts, analog_choices, channels_chosen
from addb_viewer.trial_view.by_cycle import SIDES, CycledTrial, cycle_charts
from addb_viewer.trial_view.charts import charts_of
from addb_viewer.trial_view.joint_quantities import PER_KG, JointQuantity, quantities_of
from addb_viewer.trial_view.over_time import AT_FIRST, charts_json, choices_json
from addb_viewer.trial_view.replay import JointReplay, Replay
from solver.capture.atomic import made_folder, whole_file
from solver.common.errors import CaptureError
from solver.export.gait_tables import CycledCurve, mean_table, stride_table

UNITS = {"°": "deg", "°/s": "deg_s", "m/s": "m_s", "N·m": "moment_Nm", "N": "force_N", "W": "power_W"}
CSV_OPTIONS = pa.csv.WriteOptions(quoting_style="needed")
Columns = dict[str, np.ndarray]


def write_over_time(replay: Replay, chosen: Sequence[str], file: Path, *, per_kg: bool = False) -> Path:
    """Write a row a frame of the recording, a cell without a number empty.

    Args:
        replay: the trial.
        chosen: ids of what is shown.
        file: to write; its folder is made.
        per_kg: torques and powers for each kilogram of the person.

    Raises:
        FitError, CaptureError: it cannot be written.
    """
    columns: Columns = {"frame": np.arange(replay.frames), "time_s": replay.times}
    if replay.residual is not None:
        columns["used"] = replay.residual.used
    for chart in charts_of(replay):
        if chart.title.lower() in chosen:
            lines = (line for line in chart.lines if line.is_own)
            columns |= {f"{_plain(chart.title, line.label)}_{chart.unit}": line.values for line in lines}
    if replay.joints is not None:
        columns |= _joint_columns(quantities_of(replay.joints, per_kg=per_kg), replay.joints, chosen)
    return _write(pa.table({k: pa.array(v, from_pandas=True) for k, v in columns.items()}), file)


def _joint_columns(
    quantities: Sequence[JointQuantity], joints: JointReplay, chosen: Sequence[str]
) -> Columns:
    """The chosen ones, by the model's names: knee_angle_r_moment_Nm, and its knee_angle_r_moment_std_Nm."""
    columns: Columns = {}
    for quantity in quantities:
        for _, column in quantity.columns if quantity.id in chosen else ():
            name, std = joints.names[column], quantity.std(joints, column)
            columns[f"{name}_{_unit(quantity)}"] = quantity.values(joints, column)
            if std is not None:
                unit = re.sub(r"^(moment_|force_|power_)?", r"\1std_", _unit(quantity))
                columns[f"{name}_{unit}"] = std
    return columns


def write_by_cycle(trials: Sequence[CycledTrial], chosen: Sequence[str], file: Path) -> list[Path]:
    """Write mean and deviation at each percent, and beside them every stride; nothing without strides.

    Args:
        trials: that are shown.
        chosen: ids of what is shown.
        file: of the means; its folder is made.

    Raises:
        FitError, CaptureError: it cannot be written.
    """
    found = [curve for trial in trials for curve in _curves(trial, chosen)]
    if not found:
        return []
    single = file.with_name(f"{file.stem}_strides.csv")
    return [_write(mean_table(found), file), _write(stride_table(found), single)]


def _curves(trial: CycledTrial, chosen: Sequence[str]) -> Iterator[CycledCurve]:
    for quantity in trial.quantities().values():
        if quantity.id in chosen:
            for side, curves in trial.curves(quantity):
                if len(curves.cycles):
                    yield CycledCurve(trial.of.name, side, f"{quantity.stem}_{_unit(quantity)}", curves)


def _unit(quantity: JointQuantity) -> str:
    unit = quantity.unit.removesuffix(PER_KG)
    return UNITS.get(unit, unit) + ("_kg" if unit != quantity.unit else "")


def _plain(title: str, label: str) -> str:
    return re.sub(r"\W+", "_", f"{title} {label}".lower()).strip("_")


def _write(table: pa.Table, file: Path) -> Path:
    made_folder(file.parent)
    with whole_file(file) as draft:
        pa.csv.write_csv(table, draft, CSV_OPTIONS)
    return file


PLACE = "<div data-addb-curves></div>"  # where the page's script puts its charts
FINDING = "Finding the strides …"
FOLDER = "curves"  # in the results folder
MOST_CHOSEN, LONGEST = 60, 200  # charts or trials at once; letters of a name


class By(StrEnum):
    """Over what curves are drawn."""

    TIME = "time"
    CYCLE = "cycle"


@dataclass(frozen=True)
class Choice:
    """What one browser shows as curves; it remembers that."""

    chosen: tuple[str, ...] = AT_FIRST  # ids of quantities, in order
    by: By = By.TIME
    over: tuple[str, ...] = ()  # names of trials that are drawn over the one on the screen
    per_kg: bool = False  # torques and powers for each kilogram of the person

    @classmethod
    def of(cls, said: object) -> "Choice":
        """What a browser says or remembers; what in it means nothing is dropped."""
        if not isinstance(said, dict):
            return cls()
        chosen = said.get("chosen")
        by = By.CYCLE if said.get("by") == By.CYCLE else By.TIME
        names = AT_FIRST if chosen is None else _names(chosen)
        return cls(names, by, _names(said.get("over")), said.get("per_kg") is True)


class CurvesController:
    """What one reviewer sees as curves."""

    def __init__(
        self,
        gui: viser.GuiApi,
        tab: viser.GuiTabHandle,
        screen: Screen,
        memory: BrowserMemory,
        compared: Callable[[], Replay | None],
    ) -> None:
        """Lay out the tab.

        Args:
            gui: of the browser.
            tab: where.
            screen: of the browser.
            memory: what the browser remembers.
            compared: the trial as the solve that is compared with has it; None: nothing is compared.
        """
        self.screen, self.channel, self._memory, self._compared = screen, screen.channel, memory, compared
        with tab:
            self._place = gui.add_html("")
        self.channel.on("curves", self._asked)

    @property
    def choice(self) -> Choice:
        """What is shown."""
        return Choice.of(self._memory.curves)

    def show(self) -> None:
        """Draw the charts of the trial that is on the screen."""
        replay = self.screen.replay
        if replay is None:
            return
        choice, library = self.choice, self.screen.shared.fits.shown
        others = [name for name in library.trials if name != replay.name and library.is_fitted(name)]
        self._place.content = PLACE
        channels, why_not = _channels(library, replay.name)
        told = {
            "choices": choices_json(replay, per_kg=choice.per_kg) + analog_choices(channels),
            "trials": others,
            "cycles": replay.joints is not None,
        }
        self.channel.show("curve-choices", told | asdict(choice))
        over = self._over(replay)
        if choice.by is By.CYCLE and replay.joints is not None:
            drawn = self._by_cycle([replay.name, *over]) | {"by": By.CYCLE}
        else:
            curves = [found for name in over if (found := library.curves(name)) is not None]
            analog, note = self._analog(replay, channels)
            charts = charts_json(
                replay, self._compared(), curves, choice.chosen, per_kg=choice.per_kg, ready=analog
            )
            drawn = {"charts": charts, "note": why_not or note, "by": By.TIME}
        self.channel.show("curve-charts", drawn | {"over": over})

    def write(self) -> None:
        """Write what is shown as CSV into the results folder, in place of what was there.

        Raises:
            FitError, CaptureError: it cannot be written.
        """
        replay, choice, library = self.screen.replay, self.choice, self.screen.shared.fits.shown
        if replay is None:
            return
        over, folder = self._over(replay), library.results / FOLDER
        if choice.by is By.CYCLE:
            file = folder / f"{library.stem(replay.name)}_by_cycle.csv"
            written = write_by_cycle(
                _cycled(library, [replay.name, *over], per_kg=choice.per_kg), choice.chosen, file
            )
        else:
            trials = [(replay.name, replay), *((name, library.replay(name)) for name in over)]
            written = [
                write_over_time(of, choice.chosen, folder / f"{library.stem(name)}.csv", per_kg=choice.per_kg)
                for name, of in trials
            ]
            for name, _ in trials:
                chosen = channels_chosen(choice.chosen, _channels(library, name)[0])
                if chosen and (analog := library.analog(name, chosen)) is not None:
                    file = folder / f"{library.stem(name)}_analog.csv"
                    written.append(_write(pa.table(analog.columns), file))
        if written:
            names = " and ".join(file.name for file in written)
            self.screen.notices.tell("Written", f"{names}, in {library.results.name}/{FOLDER}")
        else:
            self.screen.notices.tell("Nothing to write", "no stride is shown", important=True)

    def _over(self, replay: Replay) -> list[str]:
        """The trials that lie over this one."""
        library, over = self.screen.shared.fits.shown, self.choice.over
        return [t for t in library.trials if t in over and t != replay.name and library.is_fitted(t)]

    def _analog(
        self, replay: Replay, channels: Sequence[tuple[str, str]]
    ) -> tuple[dict[str, dict[str, Any]], str]:
        """Charts of the chosen channels, or why they cannot be read."""
        chosen = channels_chosen(self.choice.chosen, channels)
        try:
            analog = self.screen.shared.fits.shown.analog(replay.name, chosen) if chosen else None
        except CaptureError as error:
            return {}, str(error)
        return ({} if analog is None else analog_charts(analog, replay)), ""

    def _by_cycle(self, trials: Sequence[str]) -> dict[str, Any]:
        """Charts of the first trial; none while strides are looked for, which takes seconds in a long one."""
        fits = self.screen.shared.fits
        compared = None if self._compared() is None else fits.compared
        wanted = [(fits.shown, name) for name in trials] + ([(compared, trials[0])] if compared else [])
        unknown = [(library, name) for library, name in wanted if not library.knows_gait(name)]
        if unknown:
            guarded = self.screen.notices.guard("Finding strides", self._find)
            threading.Thread(target=guarded, args=(unknown,), daemon=True).start()
            return {"charts": [], "note": FINDING, "strides": {side: [] for side in SIDES}}
        per_kg = self.choice.per_kg
        own, *others = _cycled(fits.shown, trials, per_kg=per_kg)
        before = next(iter(_cycled(compared, trials[:1], per_kg=per_kg)), None) if compared else None
        return cycle_charts(own, others, self.choice.chosen, before)

    def _find(self, unknown: Sequence[tuple[Library, str]]) -> None:
        for library, name in unknown:
            library.gait(name)
        self.screen.notices.do("Charting", self.show)

    def _asked(self, said: Any) -> None:
        """The page wants something else to be shown."""
        choice = Choice.of(said)
        self.screen.notices.do("Charting", lambda: self._choose(choice))

    def _choose(self, choice: Choice) -> None:
        self._memory.curves = asdict(choice)
        self._memory.keep()
        self.show()


def _cycled(library: Library, trials: Sequence[str], *, per_kg: bool) -> list[CycledTrial]:
    found = [(library.curves(trial), trial) for trial in trials]
    return [CycledTrial(curves, library.gait(trial), per_kg) for curves, trial in found if curves is not None]


def _channels(library: Library, trial: str) -> tuple[tuple[tuple[str, str], ...], str]:
    """Name and unit of a trial's analog channels, or why they cannot be listed."""
    try:
        return library.channels(trial), ""
    except CaptureError as error:
        return (), f"Analog channels: {error}"


def _names(said: object) -> tuple[str, ...]:
    names = said if isinstance(said, list | tuple) else ()
    return tuple(name for name in names if isinstance(name, str) and len(name) <= LONGEST)[:MOST_CHOSEN]
