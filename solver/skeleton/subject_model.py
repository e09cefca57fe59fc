"""The model that a subject came with: an OpenSim file, or the one inside a .b3d file."""

from dataclasses import replace
from pathlib import Path

from solver.capture.formats.b3d.b3d_fields import Header, PassType
from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.capture.formats.b3d.places import is_b3d
from solver.common.errors import ModelError
from solver.skeleton.osim import load_skeleton
from solver.skeleton.own_model import own_model_content
from solver.skeleton.skeleton import Skeleton


def load_subject_model(path: Path) -> Skeleton:
    """Read the model that a subject names.

    Of a .b3d file: the model of its last dynamics pass, the first pass's where it has none, with the first
    pass's masses and inertias, scaled to the mass in the header. Those of later passes were learnt from the
    forces that they are to be judged by.

    Raises:
        ModelError: the file is no readable model, or holds something that a skeleton cannot express.
        CaptureError: the .b3d file is damaged.
    """
    return _stored(path, read_b3d(path).header) if is_b3d(path) else load_skeleton(path)


def subject_model_content(path: Path, fitted: Skeleton) -> bytes:
    """The file of the model that a subject names, with all that it holds, as it was fitted.

    Raises:
        ModelError: the file is no readable model, or another than was fitted.
        CaptureError: the .b3d file is damaged.
    """
    text = _stored_text(path, read_b3d(path).header) if is_b3d(path) else None
    return own_model_content(path, fitted, text)


def _stored_text(path: Path, header: Header) -> str:
    if not header.passes:
        raise ModelError(f"{path}: holds no model. Name one in {path.name}.subject/subject.toml.")
    dynamic = [one for one in header.passes if one.pass_type == PassType.DYNAMICS]
    return (dynamic or header.passes)[-1 if dynamic else 0].model_osim_text


def _stored(path: Path, header: Header) -> Skeleton:
    shape = load_skeleton(path, _stored_text(path, header))
    first = load_skeleton(path, header.passes[0].model_osim_text)
    unfitted = {body.name: body for body in first.bodies}
    missing = [body.name for body in shape.bodies if body.name not in unfitted]
    if missing:
        raise ModelError(
            f"{path}: the models of its first and last pass have other bodies: {', '.join(missing)}. Name "
            f"a model in {path.name}.subject/subject.toml."
        )
    factor = header.mass_kg / first.mass if header.mass_kg > 0 and first.mass > 0 else 1.0
    bodies = tuple(
        replace(
            body,
            mass=factor * unfitted[body.name].mass,
            com_body=unfitted[body.name].com_body,
            inertia_body=factor * unfitted[body.name].inertia_body,
        )
        for body in shape.bodies
    )
    return replace(shape, bodies=bodies)
