"""Held-out forces in words: what fit and markers miss, and where the fit is the worse of the two."""

from collections.abc import Iterator, Sequence

from solver.fitting.fit_summary import LayoutFigures, MissedFigures, TrialFigures


def layouts_judged(figures: TrialFigures) -> Iterator[tuple[str, LayoutFigures]]:
    """What is held out in words, and its layouts; of a trial."""
    layouts = figures.held_out_layouts
    if layouts is not None:
        for words, found in (("blocks", layouts.blocks), ("whole steps", layouts.steps)):
            if found is not None:
                yield words, found


def quantities(found: LayoutFigures) -> tuple[tuple[str, str, MissedFigures], ...]:
    """What was predicted, its unit, and how well."""
    return (("force", "N", found.force), ("moment", "N·m", found.moment))


def pieces_words(found: LayoutFigures, words: str) -> tuple[str, str]:
    """How many pieces, and in how many layouts."""
    pieces = words.removesuffix("s") if found.pieces == 1 else words
    return f"{found.pieces} {pieces}", f"{found.layouts} layout{'s' * (found.layouts != 1)}"


def held_out_words(figures: TrialFigures) -> tuple[str, ...]:
    """A sentence a kind of layout: what was predicted how well; none where nothing was held out."""
    said = []
    for words, found in layouts_judged(figures):
        force, moment = (_missed(missed, unit) for _, unit, missed in quantities(found))
        pieces, layouts = pieces_words(found, words)
        said.append(f"{pieces} in {layouts}, {found.frames} frames: errors {force} and {moment}")
    return tuple(said)


def worse_words(figures: TrialFigures) -> tuple[str, ...]:
    """Where the markers alone predict held-out forces better than the fit, and how surely; worst first."""
    worse = [
        (of.ratio, words, quantity, unit, of)
        for words, found in layouts_judged(figures)
        for quantity, unit, of in quantities(found)
        if of.ratio is not None and of.ratio > 1
    ]
    return tuple(
        f"worse than markers alone on held-out {words}: {quantity} {of.rms:.1f} {unit}, "
        f"markers at {cutoff_words(of.markers_cutoffs_hz)} {of.markers_rms:.1f} {unit}, "
        f"{ratio:.2f} times; {_how_sure(of.ratio_90, words)}"
        for ratio, words, quantity, unit, of in sorted(worse, key=lambda one: -one[0])
    )


def cutoff_words(cutoffs_hz: Sequence[float]) -> str:
    """One cut-off, or from the lowest to the highest."""
    low, high = min(cutoffs_hz), max(cutoffs_hz)
    return f"{low:g} Hz" if low == high else f"{low:g} to {high:g} Hz"


def _missed(of: MissedFigures, unit: str) -> str:
    return (
        f"{of.rms:.1f} {unit} (markers alone at {cutoff_words(of.markers_cutoffs_hz)} "
        f"{of.markers_rms:.1f} {unit})"
    )


def _how_sure(interval: Sequence[float] | None, words: str) -> str:
    if interval is None:
        return f"too few {words} to tell whether that is chance"
    said = f"90 % interval over {words} {interval[0]:.2f} to {interval[1]:.2f}"
    return f"{said}: beyond chance" if interval[0] > 1 else f"{said}: perhaps chance"
