"""Setup files of OpenSim's tools for exported files; those of muscles where the model has some.

TRIAL_id_setup.xml            inverse dynamics of the same files, without a second filter
reserve_actuators.xml         a weak actuator on each coordinate without one, the root's for the residual
model_moco.osim               the model with these actuators, and without locks, for Moco
TRIAL_so_setup.xml            static optimization: which muscles, with what force
TRIAL_jra_setup.xml           joint reaction analysis of these forces
TRIAL_moco_inverse_setup.xml  Moco's MocoInverse: the same with activation dynamics
"""

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from solver.capture.atomic import whole_file, write_whole
from solver.skeleton.muscle_paths import bodies_of_path
from solver.skeleton.osim_document import Node, children, read_document
from solver.skeleton.osim_edits import OsimEdits
from solver.skeleton.osim_parts import Frames
from solver.skeleton.skeleton import Skeleton

VERSION = "40000"  # OpenSim 4.0 and every later one read it
NO_FILTER = "-1"  # the motion is filtered as the forces are; a second filter would tear them apart
RESERVES = "reserve_actuators.xml"
MOCO_MODEL = "model_moco.osim"
# [N or N·m] for a unit of control: where muscles can do it, where nothing else can, where a joint is locked
WEAK, STRONG, FREE = 1.0, 100.0, 1000.0
MESH_S = 0.02  # [s] between Moco's mesh points, its own default


@dataclass(frozen=True)
class SetupFiles:
    """What a trial's setups name: files of one folder, and when."""

    folder: Path
    stem: str  # of the trial's files
    coordinates: str
    loads: str
    span: tuple[float, float]  # first and last time [s]
    counted: tuple[float, float]  # likewise, of the longest stretch of which every force counts

    def path(self, kind: str) -> Path:
        """Of a setup file."""
        return self.folder / f"{self.stem}_{kind}_setup.xml"


def write_inverse_dynamics_setup(files: SetupFiles) -> Path:
    """Have OpenSim's InverseDynamicsTool compute the torques of exported files.

    Raises:
        CaptureError: the file cannot be written.
    """
    path = files.path("id")
    document, tool = _document("InverseDynamicsTool", path.stem)
    set_property(tool, "results_directory", ".")
    set_property(tool, "model_file", "model.osim")
    set_property(tool, "time_range", "{:.12g} {:.12g}".format(*files.span))
    set_property(tool, "forces_to_exclude", "ALL")
    set_property(tool, "external_loads_file", files.loads)
    set_property(tool, "coordinates_file", files.coordinates)
    set_property(tool, "lowpass_cutoff_frequency_for_coordinates", NO_FILTER)
    set_property(tool, "output_gen_force_file", f"{files.stem}_id_opensim.sto")
    return write_document(document, path)


def write_muscle_setups(files: SetupFiles) -> list[Path]:
    """Have OpenSim divide the torques among muscles, on the frames that count.

    Raises:
        CaptureError: a file cannot be written.
    """
    optimization = _analysis(files, "so", "StaticOptimization", {"activation_exponent": "2"})
    forces = f"{files.stem}_so_StaticOptimization_force.sto"
    frames = {"joint_names": "ALL", "apply_on_bodies": "child", "express_in_frame": "child"}
    reaction = _analysis(files, "jra", "JointReaction", {"forces_file": forces, **frames})
    return [optimization, reaction, _moco_inverse(files)]


def _analysis(files: SetupFiles, kind: str, analysis: str, more: dict[str, str]) -> Path:
    path, (first, last) = files.path(kind), (f"{time:.12g}" for time in files.counted)
    document, tool = _document("AnalyzeTool", f"{files.stem}_{kind}")
    set_property(tool, "model_file", "model.osim")
    set_property(tool, "replace_force_set", "false")
    set_property(tool, "force_set_files", RESERVES)
    set_property(tool, "results_directory", ".")
    set_property(tool, "initial_time", first)
    set_property(tool, "final_time", last)
    objects = SubElement(SubElement(tool, "AnalysisSet", name="Analyses"), "objects")
    node = SubElement(objects, analysis, name=analysis)
    for name, text in {"start_time": first, "end_time": last, "step_interval": "1", **more}.items():
        set_property(node, name, text)
    set_property(tool, "external_loads_file", files.loads)
    set_property(tool, "coordinates_file", files.coordinates)
    set_property(tool, "lowpass_cutoff_frequency_for_coordinates", NO_FILTER)
    return write_document(document, path)


def _moco_inverse(files: SetupFiles) -> Path:
    path = files.path("moco_inverse")
    document, tool = _document("MocoInverse", path.stem)
    set_property(tool, "initial_time", f"{files.counted[0]:.12g}")
    set_property(tool, "final_time", f"{files.counted[1]:.12g}")
    set_property(tool, "mesh_interval", f"{MESH_S}")
    model = SubElement(tool, "ModelProcessor", name="model")
    set_property(model, "filepath", MOCO_MODEL)
    operators = SubElement(model, "operators")
    set_property(SubElement(operators, "ModOpAddExternalLoads"), "filepath", files.loads)
    SubElement(operators, "ModOpIgnoreTendonCompliance")
    SubElement(operators, "ModOpReplaceMusclesWithDeGrooteFregly2016")
    motion = SubElement(tool, "TableProcessor", name="kinematics")
    set_property(motion, "filepath", files.coordinates)
    SubElement(SubElement(motion, "operators"), "TabOpUseAbsoluteStateNames")
    set_property(tool, "kinematics_allow_extra_columns", "true")
    return write_document(document, path)


def write_reserves(model: Path, skeleton: Skeleton) -> list[Path]:
    """Actuators that a model's muscles need beside them, and the model with them for Moco.

    Moco knows no locked coordinates. In its model they are free, held by the motion and by actuators that
    cost next to nothing.

    Args:
        model: the exported model's file; others lie beside it.
        skeleton: that it holds.

    Returns:
        The files written; none for a model without muscles.

    Raises:
        ModelError, CaptureError: the model cannot be read, or a file not written.
    """
    document = read_document(model)
    nodes = [node for node in document.model.iter() if isinstance(node, Node)]
    frames, sets = Frames(document), children(document.model, "ForceSet")
    owners = [node for node in nodes if node.find("optimal_fiber_length") is not None]
    paths = [path for node in owners if (path := bodies_of_path(document, frames, node))]
    if not paths or not (forces := children(sets[0], "objects")):
        return []
    driven = {document.word(node, "coordinate") for node in nodes if node.tag.endswith("CoordinateActuator")}
    table, edits, weak = {c.name: c for c in skeleton.coordinates}, OsimEdits(document), []
    for body, joint in enumerate(skeleton.joints):
        beyond = _beyond(skeleton, body)
        is_crossed = any(path & beyond and path - beyond for path in paths)
        for name in dict.fromkeys(
            a.coordinate for a in joint.axes if a.coordinate and a.coordinate not in driven
        ):
            if table[name].locked:
                edits.append(forces[0], tostring(_actuator(name, FREE), encoding="unicode"))
            elif table[name].coupling is None:
                weak.append(_actuator(name, WEAK if is_crossed else STRONG))
    root, reserves = _document("ForceSet", "reserves")
    SubElement(reserves, "objects").extend(weak)
    for actuator in weak:
        edits.append(forces[0], tostring(actuator, encoding="unicode"))
    for node in nodes:
        if node.tag == "Coordinate" and document.flag(node, "locked", False):
            edits.set(node, "locked", False)
    with whole_file(model.with_name(MOCO_MODEL)) as file:
        file.write(edits.content())
    return [write_document(root, model.with_name(RESERVES)), model.with_name(MOCO_MODEL)]


def _actuator(coordinate: str, strength: float) -> Element:
    actuator = Element("CoordinateActuator", name=f"{coordinate}_reserve")
    set_property(actuator, "min_control", "-inf")
    set_property(actuator, "max_control", "inf")
    set_property(actuator, "coordinate", coordinate)
    set_property(actuator, "optimal_force", f"{strength}")
    return actuator


def _beyond(skeleton: Skeleton, body: int) -> set[str]:
    """The body and all that hangs on it."""
    found = {body}
    for child, joint in enumerate(skeleton.joints):
        if joint.parent in found:
            found.add(child)
    return {skeleton.bodies[one].name for one in found}


def _document(kind: str, name: str) -> tuple[Element, Element]:
    document = Element("OpenSimDocument", Version=VERSION)
    return document, SubElement(document, kind, name=name)


def set_property(owner: Element, name: str, text: str) -> None:
    """Add a property to an object of OpenSim's."""
    SubElement(owner, name).text = text


def write_document(document: Element, path: Path) -> Path:
    """Write an XML document as OpenSim lays it out.

    Raises:
        CaptureError: the file cannot be written.
    """
    indent(document, "\t")
    declaration = '<?xml version="1.0" encoding="UTF-8"?>\n'
    write_whole(path, declaration + tostring(document, encoding="unicode") + "\n")
    return path
