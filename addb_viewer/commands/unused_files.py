"""What is said of a folder's files that are not used: one line, or all of them with reasons."""

from collections.abc import Sequence

from solver.capture.capture import UnusedFile

NAMED = 3  # in one line


def unused_lines(files: Sequence[UnusedFile], *, whole: bool) -> list[str]:
    """Which files of a subject's folder are not used, the most harmful first.

    Args:
        files: as `open_subject` found them.
        whole: each with its reason.
    """
    if not files:
        return []
    count = f"{len(files)} file{'s' * (len(files) > 1)} of the folder not used"
    if whole:
        return [f"{count}:", *(f"  {file.file}: {file.reason}" for file in files)]
    more = ", …" if len(files) > NAMED else ""
    return [f"{count}: {', '.join(file.file for file in files[:NAMED])}{more}; --notes says why"]
