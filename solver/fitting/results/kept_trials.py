"""Which forces a kept fit used and what detection proposed, without reading the rest of its arrays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from solver.common.errors import ResultsError
from solver.common.npz import stored_arrays
from solver.common.small_files import json_content, json_of
from solver.contact.detected_ranges import Proposal
from solver.contact.wrenches import FrameMask
from solver.fitting.provenance import extension_in
from solver.fitting.results.codec import Decoder
from solver.fitting.results.named import named_in
from solver.fitting.results.store import has_fit, read_whole

_REMEMBERED = 1024  # trials


@dataclass(frozen=True, eq=False)
class KeptTrial:
    """One trial of a kept fit."""

    feet: tuple[str, ...]  # of the mask's columns
    proposals: tuple[Proposal, ...]
    mask: FrameMask | None  # None: it has no forces, or none were fitted to
    extension: str | None = None  # fingerprint of the accepted causes that the fit has in its model


def kept_trials(folder: Path) -> Mapping[str, KeptTrial]:
    """The trials of a kept fit by name; none where there is no fit.

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


def _of_trials(files: Sequence[Path]) -> dict[str, KeptTrial]:
    (about,) = (path for path in files if path.name == "subject.json")
    extension = _extension(about, about.stat().st_mtime_ns)
    found = dict(_read(path, path.stat().st_mtime_ns) for path in files if path.suffix == ".npz")
    return {name: replace(trial, extension=extension) for name, trial in found.items()}


@lru_cache(_REMEMBERED)
def _extension(path: Path, written_at: int) -> str | None:
    return extension_in(Decoder(path.parent).decode(json_content(path)["provenance"]))


@lru_cache(_REMEMBERED)
def _read(path: Path, written_at: int) -> tuple[str, KeptTrial]:
    """Name and content of one trial; read again when the file was written again."""
    fields = json_of(str(stored_arrays(path, "tree")["tree"]))["fields"]
    kept = KeptTrial((), Decoder(path.parent).decode(fields["proposals"]), None)
    if fields["mask"] and fields["contacts"] and fields["dynamics"]:
        places = [tree["stored"] for tree in fields["mask"]["fields"].values() if "stored" in (tree or ())]
        decoder = Decoder(path.parent, stored_arrays(path, *places))
        feet = decoder.decode(fields["contacts"]["fields"]["foot_bodies"])
        kept = replace(kept, feet=feet, mask=decoder.decode(fields["mask"]))
    return fields["capture"]["fields"]["name"], kept
