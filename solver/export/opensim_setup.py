"""OpenSim's setup files: external loads, and the inverse dynamics tool."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from solver.capture.atomic import write_whole

VERSION = "40000"  # OpenSim 4.0 and every later one read it
NO_FILTER = "-1"  # the motion is filtered as the forces are; a second filter would tear them apart


def write_external_loads(path: Path, foot_bodies: Sequence[str], forces: Path) -> None:
    """Say which body each foot's columns of a force file act on.

    Args:
        path: of the file to write, beside `forces`.
        foot_bodies: names of the bodies, as in the columns.
        forces: the .mot file.

    Raises:
        CaptureError: the file cannot be written.
    """
    document = Element("OpenSimDocument", Version=VERSION)
    loads = SubElement(document, "ExternalLoads", name=path.stem)
    objects = SubElement(loads, "objects")
    for foot in foot_bodies:
        force = SubElement(objects, "ExternalForce", name=foot)
        _property(force, "applied_to_body", foot)
        _property(force, "force_expressed_in_body", "ground")
        _property(force, "point_expressed_in_body", "ground")
        _property(force, "force_identifier", f"ground_force_{foot}_v")
        _property(force, "point_identifier", f"ground_force_{foot}_p")
        _property(force, "torque_identifier", f"ground_torque_{foot}_")
    _property(loads, "datafile", forces.name)
    _write(document, path)


def write_inverse_dynamics_setup(
    path: Path, *, model: str, coordinates: Path, loads: Path, span: tuple[float, float], result: str
) -> None:
    """Have OpenSim's InverseDynamicsTool compute the torques of exported files, all in one folder.

    Args:
        path: of the setup file.
        model: the model's file name.
        coordinates: the motion's file.
        loads: the external loads' file.
        span: first and last time [s].
        result: name of the file that the tool will write.

    Raises:
        CaptureError: the file cannot be written.
    """
    document = Element("OpenSimDocument", Version=VERSION)
    tool = SubElement(document, "InverseDynamicsTool", name=path.stem)
    _property(tool, "results_directory", ".")
    _property(tool, "model_file", model)
    _property(tool, "time_range", f"{span[0]:.12g} {span[1]:.12g}")
    _property(tool, "forces_to_exclude", "Muscles")
    _property(tool, "external_loads_file", loads.name)
    _property(tool, "coordinates_file", coordinates.name)
    _property(tool, "lowpass_cutoff_frequency_for_coordinates", NO_FILTER)
    _property(tool, "output_gen_force_file", result)
    _write(document, path)


def _property(owner: Element, name: str, text: str) -> None:
    SubElement(owner, name).text = text


def _write(document: Element, path: Path) -> None:
    indent(document, "\t")
    declaration = '<?xml version="1.0" encoding="UTF-8"?>\n'
    write_whole(path, declaration + tostring(document, encoding="unicode") + "\n")
