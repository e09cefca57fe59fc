"""Held-out forces in words: what fit and markers miss, and where the fit is the worse of the two."""

from collections.abc import Mapping, Sequence
from typing import Any

KINDS = {"blocks": "blocks", "steps": "whole steps"}
QUANTITIES = {"force": "N", "moment": "N·m"}


def held_out_words(figures: Mapping[str, Any]) -> tuple[str, ...]:
    """A sentence a kind of layout: what was predicted how well; none before the first layout.

    Args:
        figures: of a trial, in the shape of `fit --json`.
    """
    held_out_layouts = figures.get("held_out_layouts") or {}
    said = []
    for kind, words in KINDS.items():
        found = held_out_layouts.get(kind)
        if found:
            each = [_missed(found[quantity], unit) for quantity, unit in QUANTITIES.items()]
            layouts = "layout" if found["layouts"] == 1 else "layouts"
            pieces = words.removesuffix("s") if found["pieces"] == 1 else words
            said.append(
                f"{found['pieces']} {pieces} held out in {found['layouts']} {layouts}, "
                f"{found['frames']} frames: errors {each[0]} and {each[1]}"
            )
    return tuple(said)


def worse_words(figures: Mapping[str, Any]) -> tuple[str, ...]:
    """Where the markers alone predict held-out forces better than the fit, by how much and how surely.

    Args:
        figures: of a trial, in the shape of `fit --json`.
    """
    held_out_layouts = figures.get("held_out_layouts") or {}
    said = []
    for kind, words in KINDS.items():
        found = held_out_layouts.get(kind) or {}
        for quantity, unit in QUANTITIES.items():
            of = found.get(quantity)
            if of and of["ratio"] is not None and of["ratio"] > 1:
                said.append(
                    f"worse than markers alone on held-out {words}: {quantity} {of['rms']:.1f} {unit}, "
                    f"markers at {cutoff_words(of['markers_cutoffs_hz'])} {of['markers_rms']:.1f} {unit}, "
                    f"{of['ratio']:.2f} times; {_how_sure(of['ratio_90'], words)}"
                )
    return tuple(said)


def rest_words(figures: Sequence[Mapping[str, Any]]) -> str | None:
    """That layouts are still to come; None where none is, or nothing was held out.

    Args:
        figures: of all trials, in the shape of `fit --json`.
    """
    for trial in figures:
        held_out_layouts = trial.get("held_out_layouts")
        if held_out_layouts and held_out_layouts["layouts"] < held_out_layouts["of"]:
            return (
                f"held-out forces: {held_out_layouts['layouts']} of {held_out_layouts['of']} layouts are "
                f"evaluated so far; "
                "addb-viewer fit continues with the others"
            )
    return None


def cutoff_words(cutoffs_hz: Sequence[float]) -> str:
    """One cut-off, or from the lowest to the highest."""
    low, high = min(cutoffs_hz), max(cutoffs_hz)
    return f"{low:g} Hz" if low == high else f"{low:g} to {high:g} Hz"


def _missed(of: Mapping[str, Any], unit: str) -> str:
    return (
        f"{of['rms']:.1f} {unit} (markers alone at {cutoff_words(of['markers_cutoffs_hz'])} "
        f"{of['markers_rms']:.1f} {unit})"
    )


def _how_sure(interval: Sequence[float] | None, words: str) -> str:
    if interval is None:
        return f"too few {words} to tell whether that is chance"
    said = f"90 % interval over {words} {interval[0]:.2f} to {interval[1]:.2f}"
    return f"{said}: beyond chance" if interval[0] > 1 else f"{said}: perhaps chance"
