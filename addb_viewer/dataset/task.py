"""What is to be done to one subject, as one process hands it to another."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from addb_viewer.dataset.options import BuildOptions, options_from
from addb_viewer.dataset.release_subject import ReleaseSubject


@dataclass(frozen=True)
class Task:
    """A subject to be fitted, and where its files go."""

    key: str  # SHA-256 of all that the files depend on
    place: Path  # of the subject: folder or .b3d file
    who: ReleaseSubject
    trials: tuple[str, ...]  # that are wanted
    options: BuildOptions
    out: Path  # folder of the files
    frames: int  # of all wanted trials

    def write(self, path: Path) -> None:
        """As JSON, for a process of its own."""
        plain = asdict(self) | {"place": str(self.place), "out": str(self.out)}
        path.write_text(json.dumps(plain), encoding="utf-8")


def read_task(path: Path) -> Task:
    """What `Task.write` wrote."""
    plain: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    who = plain["who"] | {"filled": tuple(plain["who"]["filled"])}
    return Task(
        key=plain["key"],
        place=Path(plain["place"]),
        who=ReleaseSubject(**who),
        trials=tuple(plain["trials"]),
        options=options_from(plain["options"]),
        out=Path(plain["out"]),
        frames=plain["frames"],
    )
