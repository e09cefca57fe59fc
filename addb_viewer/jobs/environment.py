"""What surrounds a process of ours: environment variables, the packages it finds, and who has started it."""

import os
import sys
import threading
from importlib.util import find_spec
from pathlib import Path

STORE = "ADDB_VIEWER_STORE"  # URL of a database that several people share
ROOT = "ADDB_VIEWER_ROOT"  # the folder that all of its subjects lie below
ENDS_WITH_STDIN = "ADDB_VIEWER_ENDS_WITH_STDIN"  # set for processes that end with the one that started them
PATIENCE_S = 5.0  # for a process that was told to end
NAMES = ("solver", "annotations")  # packages of ours with common names


def end_with_parent() -> None:
    """In a process that was started to end with its parent: do so from now on, also when that is killed."""
    if os.environ.pop(ENDS_WITH_STDIN, None):
        threading.Thread(target=_end_with_stdin, name="end of the parent", daemon=True).start()


def _end_with_stdin() -> None:
    """End this process once nobody holds the other end of stdin; where it does not obey, at once."""
    from solver.common.operating_system import end_self  # noqa: PLC0415 (once it is known to be ours)

    while os.read(sys.stdin.fileno(), 1):
        pass
    end_self(PATIENCE_S)


def own_process(module: str) -> list[str]:
    """How a process of ours runs a module: what lies in the working folder, a recording's, is not imported.

    Args:
        module: its name, dots between.

    Returns:
        The first words of a command line. From a checkout that is not installed, run in its own folder, that
        folder stays on the path.
    """
    here = Path(__file__).resolve().parents[2]
    safe = [] if here == Path.cwd() else ["-P"]
    return [sys.executable, *safe, "-m", module]


def check_own_packages() -> None:
    """Refuse to go on where Python finds another package under the name of one of ours.

    Raises:
        ImportError: says where the other one lies and what to do.
    """
    here = Path(__file__).resolve().parents[2]
    for name in NAMES:
        found = _place_of(name)
        if found != here / name:
            raise ImportError(
                f"addb-viewer needs its own package '{name}' in {here}, but Python finds "
                f"{found or 'none of that name'}. Rename or uninstall that one, start Python in another "
                "folder, or install addb-viewer into an environment of its own: python -m venv ENV",
                name=name,
                path=str(found or here),
            )


def _place_of(name: str) -> Path | None:
    """Folder of the package that an import would give; of a single file, the file."""
    try:
        spec = find_spec(name)
    except ValueError:  # somebody put an object under that name that is no package
        return None
    if spec is None or spec.origin is None:
        return None
    origin = Path(spec.origin).resolve()
    return origin.parent if origin.name == "__init__.py" else origin
