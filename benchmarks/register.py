"""The register of the solver's numeric constants, for benchmarks that set them otherwise."""

import importlib.util
import sys
from pathlib import Path

from benchmarks.rewriting import Number

SCRIPT = Path(__file__).parents[1] / "scripts" / "constants.py"


def tuned_numbers(rooms: tuple[str, ...]) -> list[Number]:
    """Constants at the top of modules that are tuned, by file and name.

    Args:
        rooms: how their files begin.
    """
    spec = importlib.util.spec_from_file_location("constants_register", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    script = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    known = script.register()
    found = [
        Number(one.file, one.name)
        for one in script.constants()
        if not one.is_setting
        and one.file.startswith(rooms)
        and one.name in known.get(one.file, {}).get(script.TUNED, ())
    ]
    return sorted(found, key=lambda number: (number.file, number.name))
