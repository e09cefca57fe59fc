"""The ablation's runs as Markdown: the bars first, then every arm; mean ± standard deviation."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

MOST_RESIDUAL = 1.1  # ours by the oracle's, on frames that both see
ARMS_HEAD = "| hidden | arm | seen N | seen N·m | markers cm | hidden N | hidden N·m | knee N·m |"
FIGURES = (
    ("residual_N", 1, ".1f"),
    ("residual_Nm", 1, ".1f"),
    ("marker_rms_m", 100, ".2f"),
    ("hidden_N", 1, ".0f"),
    ("hidden_Nm", 1, ".0f"),
    ("knee_Nm", 1, ".1f"),
)
BARS_HEAD = (
    "| hidden | steps | choices | ours / oracle, seen N: mean ± sd | worst | above 1.1 | seen N·m, worst "
    "| markers, worst | ours / markers only, hidden N: mean ± sd | worst | hidden N·m, worst "
    "| knee: ours less oracle N·m | not settled |"
)
INTRODUCTION = """# Ablation: what hidden forces cost

{made}

Right steps' forces are hidden, the trial is fitted without them and compared with the fit that sees them:
every third step, and shares of the steps chosen at random. Mean ± standard deviation over the choices of
hidden steps. What the arms and columns mean: [ablation](../docs/command-line.md#ablation). *seen*: frames
whose forces both the oracle and ours see; *hidden*: the other ones, on which the force that the motion
demands is held against the hidden measurement. The bars: seen N at most 1.1 times the oracle's, marker RMS
within 5 % of the oracle's, hidden N below markers only.

- With each step the frames are hidden that the forces' filter spreads it over, as in a detected range
  (`border_s` of `[detection]`): what the filter leaves there is the hidden force's. Measured once without it,
  seen N of the treadmill walk was 1.11 ± 0.06 times the oracle's at 60 %, 1.20 at worst, and all the excess
  of the runs looked at lay within 10 frames of hidden steps, most in the last one before an unseen landing.
- Short trials have few different choices. A share is rounded to whole steps, at least one, and conditions
  that come to the same choices stand in one row.
- All arms get one scaled model and one mass, and fit their own inertias. Piecewise differs from ours only in
  where the joint fit begins; the cost is the same, and so is the end where both settle.
- *Not settled*: runs with an arm whose fit ended at the ceiling of iterations, or found no lower cost.
"""


@dataclass(frozen=True)
class Rows:
    """Runs of one way to hide steps."""

    names: tuple[str, ...]  # of the conditions that come to these choices
    hidden: int  # steps
    wanted: int  # choices
    runs: list[dict[str, Any]]

    @property
    def label(self) -> str:
        """As in the tables' first column."""
        return ", ".join(name.removesuffix(" of the steps") for name in self.names)

    def values(self, arm: str, figure: str) -> np.ndarray:
        """One figure of an arm, by run; NaN where a run has no frame to judge."""
        return np.array([run["arms"][arm][figure] for run in self.runs], dtype=float)

    def ratio(self, figure: str, arm: str, other: str) -> np.ndarray:
        """An arm's figure by another arm's, by run."""
        return self.values(arm, figure) / self.values(other, figure)


def page(sections: Sequence[tuple[str, dict[str, Any], list[Rows]]], made: str) -> str:
    """Markdown of all recordings.

    Args:
        sections: name, what it is, and runs of each recording.
        made: when and how.
    """
    parts = [INTRODUCTION.format(made=made)]
    for name, about, rows in sections:
        steps = len(about["right_steps"])
        seconds = about["frames"] / about["rate_hz"]
        parts.append(
            f"## {name}: {seconds:.1f} s, {steps} right steps, {about['mass_kg']:.1f} kg\n\n"
            f"{bars(rows, steps)}\n\n{arms(rows)}\n"
        )
    return "\n".join(parts)


def bars(rows: list[Rows], steps: int) -> str:
    """A line per condition: what is asked of ours."""
    lines = [BARS_HEAD, "|---" + "|---:" * (BARS_HEAD.count("|") - 2) + "|"]
    for row in rows:
        seen = row.ratio("residual_N", "ours", "oracle")
        moment = row.ratio("residual_Nm", "ours", "oracle")
        markers = row.ratio("marker_rms_m", "ours", "oracle")
        hidden = row.ratio("hidden_N", "ours", "markers only")
        hidden_moment = row.ratio("hidden_Nm", "ours", "markers only")
        lines.append(
            f"| {row.label} | {row.hidden} of {steps} | {_made(row)} "
            f"| {_spread(seen, '.2f')} | {np.nanmax(seen):.2f} | {int((seen > MOST_RESIDUAL).sum())} "
            f"| {np.nanmax(moment):.2f} | {np.nanmax(markers):.3f} "
            f"| {_spread(hidden, '.2f')} | {np.nanmax(hidden):.2f} | {np.nanmax(hidden_moment):.2f} "
            f"| {_spread(row.values('ours', 'knee_Nm'), '.1f')} | {sum(bool(r['notes']) for r in row.runs)} |"
        )
    return "\n".join(lines)


def arms(rows: list[Rows]) -> str:
    """A line per condition and arm."""
    lines = [ARMS_HEAD, "|---|---|" + "---:|" * len(FIGURES)]
    for row in rows:
        for arm in row.runs[0]["arms"]:
            cells = [_spread(factor * row.values(arm, name), form) for name, factor, form in FIGURES]
            lines.append(f"| {row.label} | {arm} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _made(row: Rows) -> str:
    return str(row.wanted) if len(row.runs) == row.wanted else f"{len(row.runs)} of {row.wanted}"


def _spread(values: np.ndarray, form: str) -> str:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return "–"
    deviation = f" ± {np.std(finite, ddof=1):{form}}" if len(finite) > 1 else ""
    return format(float(finite.mean()), form) + deviation
