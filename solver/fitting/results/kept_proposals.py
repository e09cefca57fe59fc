"""What detection proposed for the trials of a kept fit, without reading the fit's arrays."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from solver.common.errors import ResultsError
from solver.common.npz import stored_arrays
from solver.common.small_files import json_of
from solver.contact.detected_ranges import Proposal
from solver.fitting.results.codec import Decoder
from solver.fitting.results.named import named_in
from solver.fitting.results.store import has_fit, read_whole

_REMEMBERED = 1024  # trials


def kept_proposals(folder: Path) -> Mapping[str, tuple[Proposal, ...]]:
    """The proposals of each trial, by its name; none where there is no fit.

    Args:
        folder: the results folder.

    Raises:
        ResultsError: there is only half a fit, or one of another version.
    """
    if not has_fit(folder):
        return {}
    try:
        return read_whole(folder, lambda head: _of_trials(_files(folder, head)))
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise ResultsError(
            f"{folder}: cannot be read ({error}). Fit the subject again: addb-viewer fit"
        ) from error


def _files(folder: Path, head: Mapping[str, Any]) -> list[Path]:
    return [named_in(folder, name, folder / "fit.json") for name in head["files"]]


def _of_trials(files: Sequence[Path]) -> dict[str, tuple[Proposal, ...]]:
    return dict(_read(path, path.stat().st_mtime_ns) for path in files if path.suffix == ".npz")


@lru_cache(_REMEMBERED)
def _read(path: Path, written_at: int) -> tuple[str, tuple[Proposal, ...]]:
    """Name and proposals of one trial; read again when the file was written again."""
    fields = json_of(str(stored_arrays(path, "tree")["tree"]))["fields"]
    return fields["capture"]["fields"]["name"], Decoder(path.parent).decode(fields["proposals"])
