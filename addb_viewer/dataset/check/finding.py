"""What a check has found."""

from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """How bad it is."""

    ERROR = "error"  # the release must not go out
    WARNING = "warning"  # a person should look


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or looks so."""

    level: Level
    check: str  # files, schema, forces, torques, plausible, duplicates, splits, b3d, labels, against
    where: str  # file, subject or trial
    said: str

    def __str__(self) -> str:
        return f"{self.level}: {self.where}: {self.said} [{self.check}]"


def error(check: str, where: str, said: str) -> Finding:
    """Something that must be corrected.

    Args:
        check: that found it.
        where: file, subject or trial.
        said: what is wrong.
    """
    return Finding(Level.ERROR, check, where, said)


def warning(check: str, where: str, said: str) -> Finding:
    """Something to look at.

    Args:
        check: that found it.
        where: file, subject or trial.
        said: what looks wrong.
    """
    return Finding(Level.WARNING, check, where, said)
