"""Whether `solver` and `annotations`, common names, are the packages that came with this one."""

import sys
from importlib.util import find_spec
from pathlib import Path

NAMES = ("solver", "annotations")


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
