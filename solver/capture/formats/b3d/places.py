"""Where the files about a .b3d subject lie: decisions and what can be made again, each beside the recording.

    FILE.b3d            the recording, never changed
    FILE.b3d.subject/   what people decided: subject.toml, settings.toml, markers.toml, the review log
    FILE.b3d.results/   what can be made again from both

Such a subject's folder is FILE.b3d.subject, whether it is there yet or not.
"""

from pathlib import Path

SUFFIX = ".b3d"
DECISIONS = ".subject"
RESULTS = ".results"


def is_b3d(path: Path) -> bool:
    """Whether a path has the ending of such a file."""
    return path.suffix.lower() == SUFFIX


def subject_folder_of(path: Path) -> Path:
    """The folder of the subject that a path means: FILE.b3d.subject for FILE.b3d, a folder for itself."""
    return path.with_name(path.name + DECISIONS) if is_b3d(path) and not path.is_dir() else path


def recording_of(subject_folder: Path) -> Path | None:
    """The .b3d file whose decisions a folder holds; None where it is a folder of recordings."""
    if subject_folder.suffix != DECISIONS:
        return None
    file = subject_folder.with_name(subject_folder.name.removesuffix(DECISIONS))
    return file if is_b3d(file) and file.is_file() else None


def results_folder_of(subject_folder: Path) -> Path | None:
    """Where the results of a .b3d subject go; None for a folder of recordings."""
    file = recording_of(subject_folder)
    return None if file is None else file.with_name(file.name + RESULTS)


def belongs_to_b3d(folder: Path) -> bool:
    """Whether a folder holds decisions or results of a .b3d file, and no recordings."""
    return folder.suffix in (DECISIONS, RESULTS) and is_b3d(Path(folder.stem))
