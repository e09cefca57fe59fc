"""The register of the solver's numeric constants, for benchmarks that set them otherwise."""

import importlib.util
import sys
from pathlib import Path

from benchmarks.rewriting import Number

SCRIPT = Path(__file__).parents[1] / "scripts" / "constants.py"


def tuned_numbers(rooms: tuple[str, ...], *, settings: bool = False) -> list[Number]:
    """Constants at the top of modules that are tuned, by file and name.

    Args:
        rooms: how their files begin; those of an earlier room come first.
        settings: settings' defaults as well.
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
        if one.file.startswith(rooms)
        and (settings or not one.is_setting)
        and script.kind_of(one, known) not in (script.PHYSICAL, script.NUMERICAL, script.UNSORTED)
    ]

    def place(number: Number) -> tuple[int, str, str]:
        room = next(k for k, begins in enumerate(rooms) if number.file.startswith(begins))
        return room, number.file, number.name

    return sorted(found, key=place)
