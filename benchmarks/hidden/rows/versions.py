"""Which code answered: noted beside the answers, since a run may be stopped and go on with newer code."""

import json
import subprocess
from pathlib import Path

KEPT = "versions.json"


def versions(results: Path) -> list[str]:
    """Commits that answered cases, in the order of their runs."""
    path = results / KEPT
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def note_version(results: Path) -> None:
    """Add the present commit."""
    known = versions(results)
    own = _commit()
    if own not in known:
        results.mkdir(parents=True, exist_ok=True)
        (results / KEPT).write_text(json.dumps([*known, own]) + "\n", encoding="utf-8")


def _commit() -> str:
    command = ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "of no known version"
    return done.stdout.strip()
