"""The layouts of held-out forces beside a fit: a file of their own, since they come after it."""

import json
from pathlib import Path

from solver.capture.atomic import write_whole
from solver.common.errors import ResultsError
from solver.common.small_files import json_content
from solver.dynamics.cross_validation.held_out import HeldOutLayout
from solver.fitting.fit_result import Fit
from solver.fitting.results.codec import Decoder, Encoder

FILE = "held_out.json"
FORMAT = 1


def write_held_out(fit: Fit, solve: Path) -> None:
    """Write a fit's layouts into the folder that holds it, in one step; nothing where there are none."""
    if fit.held_out_layouts:
        layouts = Encoder(fit.subject.folder, inline=True).encode(fit.held_out_layouts)
        content = {"format": FORMAT, "layouts": layouts}
        write_whole(solve / FILE, json.dumps(content, ensure_ascii=False, allow_nan=False) + "\n")


def read_held_out(solve: Path, subject_folder: Path) -> tuple[HeldOutLayout, ...]:
    """The layouts in a fit's folder; none where an older version wrote it or a later one.

    Raises:
        ResultsError: the file cannot be read.
    """
    file = solve / FILE
    if not file.is_file():
        return ()
    again = f"Remove this file alone and its layouts are judged again: addb-viewer fit {subject_folder}"
    try:
        content = json_content(file)
        if content["format"] != FORMAT:
            return ()
        layouts: tuple[HeldOutLayout, ...] = Decoder(subject_folder).decode(content["layouts"])
    except (ResultsError, OSError, RecursionError, ValueError, KeyError, TypeError) as error:
        raise ResultsError(f"{file}: cannot be read ({error}). {again}") from error
    if not all(isinstance(layout, HeldOutLayout) for layout in layouts):
        raise ResultsError(f"{file}: holds something else than layouts. {again}")
    return layouts
