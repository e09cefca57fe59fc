"""What a results file names: it lies in the same folder, however the name is written, or is not followed."""

from pathlib import Path, PurePosixPath, PureWindowsPath

from solver.common.errors import ResultsError


def named_in(folder: Path, name: object, told_in: Path) -> Path:
    """A file or folder that a results file names; whether it is there is not asked.

    Args:
        folder: that holds it; may be a link itself, which its user made.
        name: relative to the folder, with `/`.
        told_in: the file that names it.

    Raises:
        ResultsError: it is no name, or it leads out of the folder, by `..` or by a link.
    """
    again = "It was not written by this program. Fit the subject again: addb-viewer fit"
    if not isinstance(name, str) or not name:
        raise ResultsError(f"{told_in}: names {name!r} where a file of the fit belongs. {again}")
    parts = PurePosixPath(name).parts
    path = folder.joinpath(*parts)
    if PureWindowsPath(name).anchor or PurePosixPath(name).is_absolute() or ".." in parts:
        raise ResultsError(f"{told_in}: names '{name}', which leads out of its folder. {again}")
    try:
        real = path.resolve()
    except (OSError, RuntimeError, ValueError) as error:  # a link to itself, a zero byte
        raise ResultsError(f"{told_in}: names {name!r}, which is no file ({error}). {again}") from error
    if not real.is_relative_to(folder.resolve()):
        raise ResultsError(f"{told_in}: names '{name}', a link out of its folder to {real}. {again}")
    return path
