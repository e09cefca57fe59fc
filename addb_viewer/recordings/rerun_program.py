"""rerun's own program: where it is, and how it runs without reporting its use to anybody."""

import json
import os
from pathlib import Path

from addb_viewer.jobs.environment import own_process


def rerun_command() -> list[str]:
    """What to run rerun's command line with; it comes with rerun-sdk."""
    return own_process("rerun_cli")


def rerun_environment(folder: Path) -> dict[str, str]:
    """An environment in which rerun finds its analytics switched off.

    The user's own choice, wherever it is kept, stays as it is.

    Args:
        folder: gets a settings file; must last as long as the program.
    """
    place = folder / "rerun"
    place.mkdir(exist_ok=True)
    off = {"analytics_enabled": False, "analytics_id": "", "metadata": {}}
    paths = {"config_file_path": str(place / "analytics.json"), "data_dir_path": str(place)}
    (place / "analytics.json").write_text(json.dumps(off | paths), encoding="utf-8")
    return os.environ | {"XDG_CONFIG_HOME": str(folder), "XDG_DATA_HOME": str(folder)}
