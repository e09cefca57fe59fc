"""Arrays with their names, units and times; as Polars or pandas frames where these are installed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from solver.capture.formats.analog_channels import AnalogChannels

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

AXES = ("x", "y", "z")
MOST_NAMED = 4  # columns in a repr
MOST_ROWS = 20  # of a printed table


class UnknownNameError(KeyError):
    """No column or trial has that name; the nearest are listed."""

    def __init__(self, name: object, known: tuple[str, ...], kind: str) -> None:
        """Of what is looked for.

        Args:
            name: as given.
            known: the names that there are.
            kind: what they name: "trial", "column".
        """
        near = get_close_matches(str(name), known, n=3)
        listed = f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(known) or 'none'}"
        super().__init__(f"no {kind} '{name}'; {listed}")

    def __str__(self) -> str:
        """The sentence itself; KeyError would put it in quotes."""
        return str(self.args[0])


@dataclass(frozen=True, eq=False, repr=False)
class Series:
    """One quantity over time: `values` [frames, names] or, of vectors, [frames, names, 3] along x, y, z.

    `series["knee_angle_r"]` is one column, [frames] or [frames, 3]; `series.std_of("knee_angle_r")` says how
    far it may be off. NumPy takes a series for its values.
    """

    values: np.ndarray  # read-only
    names: tuple[str, ...]
    units: tuple[str, ...]  # of each name; "rad", "m", "N", "Nm", ...
    times: np.ndarray  # [frames] on the recording's clock [s]
    std: np.ndarray | None = None  # standard deviations like `values`, NaN where unknown; None: all are

    def __post_init__(self) -> None:
        """Nobody can change a result."""
        for name in ("values", "times", "std"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, read_only(np.asarray(getattr(self, name))))

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the values."""
        return self.values.shape

    @property
    def unit(self) -> str:
        """The unit of all columns.

        Raises:
            ValueError: they have several; ask `units`.
        """
        if len(set(self.units)) != 1:
            raise ValueError(f"columns have several units: {', '.join(dict.fromkeys(self.units))}")
        return self.units[0]

    def __getitem__(self, name: str) -> np.ndarray:
        """One column."""
        return self.values[:, self._column(name)]

    def std_of(self, name: str) -> np.ndarray:
        """Standard deviations of one column; NaN where none is known."""
        column = self._column(name)
        return np.full_like(self.values[:, column], np.nan) if self.std is None else self.std[:, column]

    def _column(self, name: str) -> int:
        if name not in self.names:
            raise UnknownNameError(name, self.names, "column")
        return self.names.index(name)

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.values)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """The values, so that NumPy's functions take the series."""
        return np.array(self.values, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        """What it holds, in a line."""
        shape = " × ".join(map(str, self.shape))
        listed = ", ".join(self.names[:MOST_NAMED]) + (", …" if len(self.names) > MOST_NAMED else "")
        units = ", ".join(dict.fromkeys(self.units))
        span = f"{self.times[0]:.2f} to {self.times[-1]:.2f} s" if len(self.times) else "no frames"
        return f"<Series {shape} [{units}]{'' if self.std is None else ' ± std'}, {span}: {listed}>"

    @property
    def table(self) -> "Table":
        """As columns: `time_s`, each name with its axis and unit, standard deviations as NAME_std_UNIT."""
        columns = {"time_s": self.times}
        for k, (name, unit) in enumerate(zip(self.names, self.units, strict=True)):
            ending = f"_{unit}" if unit else ""
            for label, values in ((name, self.values), (f"{name}_std", self.std)):
                if values is not None and values.ndim == 2:
                    columns[f"{label}{ending}"] = values[:, k]
                elif values is not None:
                    columns |= {f"{label}_{axis}{ending}": values[:, k, a] for a, axis in enumerate(AXES)}
        return Table(columns)

    def to_polars(self) -> "pl.DataFrame":
        """A row a frame; see `table`."""
        return self.table.to_polars()

    def to_pandas(self) -> "pd.DataFrame":
        """A row a frame; see `table`."""
        return self.table.to_pandas()


@dataclass(frozen=True, eq=False, repr=False)
class Table:
    """Columns of one length, the unit in each one's name: `knee_angle_r_rad`."""

    columns: Mapping[str, np.ndarray]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the columns."""
        return tuple(self.columns)

    def __getitem__(self, name: str) -> np.ndarray:
        """One column."""
        if name not in self.columns:
            raise UnknownNameError(name, self.names, "column")
        return self.columns[name]

    def __len__(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """The rows."""
        lists = {name: values.tolist() for name, values in self.columns.items()}
        return (dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True))

    def __repr__(self) -> str:
        """What it holds, in a line."""
        listed = ", ".join(self.names[:MOST_NAMED]) + (", …" if len(self.columns) > MOST_NAMED else "")
        return f"<Table {len(self)} rows × {len(self.columns)} columns: {listed}>"

    def __str__(self) -> str:
        """The first rows, for people; a frame shows more."""
        rows = [self.names, *(tuple(map(_shown, row.values())) for row in islice(self, MOST_ROWS))]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(map(str.rjust, row, widths)).rstrip() for row in rows]
        left = len(self) - MOST_ROWS
        return "\n".join([*lines, f"… {left} more rows"] if left > 0 else lines)

    def to_polars(self) -> "pl.DataFrame":
        """As a Polars frame; what has no value is null.

        Raises:
            ImportError: Polars is not installed.
        """
        frame: pl.DataFrame = _package("polars").DataFrame(
            {name: _plain(values) for name, values in self.columns.items()}, nan_to_null=True
        )
        return frame

    def to_pandas(self) -> "pd.DataFrame":
        """As a pandas frame; a number that is not there is NaN.

        Raises:
            ImportError: pandas is not installed.
        """
        frame: pd.DataFrame = _package("pandas").DataFrame(dict(self.columns))
        return frame


def analog_series(analog: AnalogChannels | None) -> Series:
    """The channels of a recording; none where it has none."""
    if analog is None:
        return Series(np.zeros((0, 0)), (), (), np.zeros(0))
    return Series(analog.values, analog.names, analog.units, analog.times)


def read_only(array: np.ndarray) -> np.ndarray:
    """A view that nobody can write to."""
    view = array.view()
    view.flags.writeable = False
    return view


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _plain(values: np.ndarray) -> Any:
    """Texts as a list, which Polars understands; numbers as they are."""
    return values.tolist() if values.dtype == object else values


def _package(name: str) -> Any:
    """A package that only frames need."""
    try:
        return import_module(name)
    except ImportError as error:
        raise ImportError(
            f"{name} is not installed, and a {name} frame needs it. Install it: python -m pip install {name}",
            name=name,
        ) from error
