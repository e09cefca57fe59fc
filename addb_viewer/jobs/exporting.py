"""A fit as files that other tools open."""

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path

from solver.capture.atomic import files_together
from solver.common.errors import CaptureError
from solver.export.b3d.from_fit import export_b3d
from solver.export.c3d_file import export_c3d
from solver.export.export_places import notes_on_renamed
from solver.export.opensim import export_opensim
from solver.export.trial_table import export_analog, export_angles, export_csv, export_parquet
from solver.fitting.fit_result import Fit
from solver.fitting.provenance import inputs_of


class Format(StrEnum):
    """What a fit can be written as."""

    opensim = "opensim"
    b3d = "b3d"
    csv = "csv"
    parquet = "parquet"
    gltf = "gltf"
    mujoco = "mujoco"
    c3d = "c3d"


def exported(
    fit: Fit, to: Format, folder: Path, muscles_from: Path | None = None
) -> tuple[list[Path], tuple[str, ...]]:
    """Write a fit for other tools; all of its files or none.

    Args:
        fit: the solved subject.
        to: the format; all but B3D get a folder of their own.
        folder: the results folder, or another.
        muscles_from: a model whose muscles the default body gets, for OpenSim.

    Returns:
        The files written, and what people should know about them.

    Raises:
        FitError, CaptureError: the folder cannot be made, or not written to.
    """
    inputs = {path.resolve() for path in inputs_of(fit.subject)}

    def keep_inputs(places: Sequence[Path]) -> None:
        own = [place for place in places if place.resolve() in inputs]
        if own:
            raise CaptureError(f"{own[0]}: is what was fitted, and stays as it is. Choose another folder.")

    with files_together(folder, keep_inputs) as draft:
        files, notes = _written(fit, to, draft, muscles_from)
    return [folder / path.relative_to(draft) for path in files], notes


def _written(
    fit: Fit, to: Format, folder: Path, muscles_from: Path | None
) -> tuple[list[Path], tuple[str, ...]]:
    match to:
        case Format.opensim:
            files = export_opensim(fit, folder / "opensim", muscles_from)
        case Format.b3d:
            return export_b3d(fit, folder), ()
        case Format.csv | Format.parquet:
            write, suffix = (export_csv if to is Format.csv else export_parquet), f".{to}"
            files = [*write(fit, folder / to), *export_angles(fit, folder / to, suffix)]
            analog, notes = export_analog(fit, folder / to, suffix)
            return [*files, *analog], (*notes_on_renamed(fit), *notes)
        case Format.gltf:
            from solver.export.gltf import export_gltf  # noqa: PLC0415 (loads the meshes' library)

            files = export_gltf(fit, folder / "gltf")
        case Format.mujoco:
            from solver.export.mjcf import export_mujoco  # noqa: PLC0415 (likewise)

            files, notes = export_mujoco(fit, folder / "mujoco")
            return files, (*notes_on_renamed(fit), *notes)
        case Format.c3d:
            files, notes = export_c3d(fit, folder / "c3d")
            return files, (*notes_on_renamed(fit), *notes)
    return files, notes_on_renamed(fit)
