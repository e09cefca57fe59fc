"""Arguments that several commands about releases share."""

from pathlib import Path
from typing import Annotated

import typer

Release = Annotated[
    Path,
    typer.Argument(metavar="RELEASE", help="Folder of a release.", exists=True, file_okay=False),
]
