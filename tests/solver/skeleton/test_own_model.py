"""A model with muscles at the size of a fit: what follows, what stays, and OpenSim's own scale tool."""

import json
import re
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.kinematics.hip_width import hip_pair
from solver.skeleton.muscle_paths import PathLengths
from solver.skeleton.osim import load_skeleton, read_parts, skeleton_of
from solver.skeleton.osim_document import read_document
from solver.skeleton.osim_parts import Frames
from solver.skeleton.own_model import own_model_content
from solver.skeleton.scaling import scaled
from solver.skeleton.skeleton import Marker, Skeleton
from tests.solver.skeleton.limb import FACTORS, LIMB
from tests.solver.skeleton.test_osim_writer import assert_same, individual

GROWN = ("MultiplierFunction", "function", "scale", "scale_factors", "appliesForce", "locked")
GROWN += ("inertia_xy", "inertia_xz", "inertia_yz")
SPHERE = "SmoothSphereHalfSpaceForce"
LENGTHS = ("optimal_fiber_length", "tendon_slack_length", "resting_length")
PLACES = ("location", "translation", "radius", "length", "dimensions", "inner_radius", "outer_radius")


@pytest.fixture
def limb(tmp_path) -> Path:
    path = tmp_path / "limb.osim"
    path.write_text(LIMB, encoding="latin-1")
    return path


def at(skeleton: Skeleton, factors: dict[str, np.ndarray]) -> Skeleton:
    return scaled(skeleton, np.array([factors[name] for name in skeleton.body_names]), skeleton.mass)


def elements(content: bytes) -> list[tuple[str, str | None, str]]:
    return [(node.tag, node.get("name"), (node.text or "").strip()) for node in fromstring(content).iter()]


# ---- what stays -----------------------------------------------------------------------------------------


def test_at_its_own_size_every_byte_stays_and_one_comment_is_added(limb):
    content = own_model_content(limb, load_skeleton(limb))
    comment = b"<!-- written by addb-viewer: this model at the size of a fit -->\n"
    assert content.replace(comment, b"", 1) == limb.read_bytes()


def test_scaled_it_keeps_comments_unknown_elements_and_everything_that_has_no_size(limb):
    own = "<Plugin_Force name='ours'><gain unit=\"N\">7</gain><location>9 9 9</location></Plugin_Force>"
    limb.write_text(LIMB.replace("<PathSpring", own + "<!-- x > y --><PathSpring"), encoding="latin-1")
    before = limb.read_bytes()
    after = own_model_content(limb, at(load_skeleton(limb), FACTORS))
    assert own.encode() + b"<!-- x > y -->" in after
    assert re.findall(rb"<!--.*?-->", before) == re.findall(rb"<!--(?! written by).*?-->", after)
    assert 'name="limb_of_Zoë"' in after.decode("latin-1")
    sizes = ("mass_center", "inertia", "scale_factors", "value", "scale", "function", "SimmSpline")
    sizes += ("MultiplierFunction", *PLACES, *LENGTHS)
    stay, stayed = ([one for one in elements(text) if one[0] not in sizes] for text in (before, after))
    assert stay == stayed
    assert len(stay) > 150


@pytest.mark.real
def test_all_models_keep_what_they_have_and_move_as_the_fit_does(model_files, tmp_path, subtests):
    """Their hips a tenth further apart than their pelvis' factor has them, and markers moved."""
    for path in model_files:
        if "Scapulothoracic" in path.name:
            continue
        with subtests.test(path.name):
            unlike = individual(load_skeleton(path))
            fitted = hip_pair(unlike).widened(unlike, 1.1)
            content = own_model_content(path, fitted)
            (tmp_path / "own.osim").write_bytes(content)
            is_old = read_document(path).version < 40000  # OpenSim keeps six digits of these
            assert_same(
                load_skeleton(tmp_path / "own.osim"),
                fitted,
                **({"rtol": 1e-5, "atol": 1e-6} if is_old else {}),
            )
            texts = path.read_bytes(), content
            before, after = (Counter(tag for tag, *_ in elements(text) if tag not in GROWN) for text in texts)
            assert before == after
            assert {one.findtext("appliesForce") for one in fromstring(content).iter(SPHERE)} <= {"false"}


def test_another_model_than_was_fitted_is_told(limb, crane):
    with pytest.raises(ModelError, match=r"limb.osim:4: Model 'limb_of_Zoë': it is not the model that was"):
        own_model_content(limb, crane)


# ---- what follows ---------------------------------------------------------------------------------------


def test_points_frames_surfaces_and_meshes_follow_their_body(limb):
    content = own_model_content(limb, at(load_skeleton(limb), FACTORS)).decode("latin-1")

    def numbers(after: str, tag: str) -> np.ndarray:
        part = content[content.index(after) :]
        return np.array(part[part.index(f"<{tag}>") + len(tag) + 2 :].split("<")[0].split(), dtype=float)

    thigh, shank = FACTORS["thigh"], FACTORS["shank"]
    np.testing.assert_allclose(numbers('PathPoint name="o"', "location"), thigh * [0.06, -0.1, 0.01])
    np.testing.assert_allclose(numbers('PathPoint name="i"', "location"), shank * [0.05, -0.1, -0.02])
    np.testing.assert_allclose(numbers('Frame name="tilted"', "translation"), thigh * [0.02, -0.1, 0.03])
    np.testing.assert_allclose(numbers('Frame name="one"', "translation"), thigh * [0, -0.4, 0.01])
    np.testing.assert_allclose(numbers('name="pulley"', "translation"), thigh * [0.01, -0.39, 0])
    np.testing.assert_allclose(numbers('name="heel"', "location"), shank * [-0.05, -0.4, 0])
    assert numbers('name="heel"', "radius") == 0.03
    np.testing.assert_allclose(numbers('Body name="thigh"', "scale_factors"), thigh)
    spring, straight = (
        numbers("<PathSpring", "resting_length") / 0.3,
        numbers('"straight"', "tendon_slack_length") / 0.2,
    )
    np.testing.assert_allclose(spring, straight)


def test_new_markers_are_added_moved_ones_moved_and_others_scaled(limb, tmp_path):
    skeleton = at(load_skeleton(limb), FACTORS)
    knee = replace(skeleton.markers[0], position_body=np.array([0.01, -0.35, 0.06]))
    new = Marker('A "b" & ü', 1, np.array([0.1, 0.2, 0.3]))
    fitted = skeleton.with_markers((knee, new))
    (tmp_path / "own.osim").write_bytes(own_model_content(limb, fitted))
    back = {m.name: m for m in load_skeleton(tmp_path / "own.osim").markers}
    np.testing.assert_allclose(back["KNEE"].position_body, knee.position_body, atol=1e-12)
    np.testing.assert_allclose(back["SPARE"].position_body, FACTORS["shank"] * [0, -0.1, 0.1])
    assert back['A_"b"_&_ü'].body == 1
    np.testing.assert_array_equal(back['A_"b"_&_ü'].position_body, new.position_body)
    limb.write_text(re.sub(r"(?s)<MarkerSet.*</MarkerSet>", "", LIMB), encoding="latin-1")
    (tmp_path / "own.osim").write_bytes(own_model_content(limb, fitted))
    assert load_skeleton(tmp_path / "own.osim").marker_names == ("KNEE", 'A_"b"_&_ü')


# ---- paths ----------------------------------------------------------------------------------------------


def lengths(path: Path) -> dict[str, float]:
    document = read_document(path)
    skeleton = skeleton_of(document, read_parts(document))
    paths = PathLengths(document, Frames(document, {}), skeleton, {})
    owners = [node for node in document.model.iter() if node.find("GeometryPath") is not None]
    return {node.get("name"): paths.of(node.find("GeometryPath")) for node in owners}


def taut(start: np.ndarray, end: np.ndarray, semi_axes: np.ndarray, side: np.ndarray) -> float:
    """A string of many points pulled tight round an ellipsoid, or a cylinder of infinite third axis."""
    share = np.linspace(0, 1, 101)[:, None]
    string = start + share * (end - start) + 0.2 * np.sin(np.pi * share) * side
    for _ in range(12_000):
        for half in (slice(1, -1, 2), slice(2, -1, 2)):
            middle = (string[:-2] + string[2:])[half.start - 1 :: 2] / 2
            depth = np.linalg.norm(middle / semi_axes, axis=1, keepdims=True)
            out = middle * np.isfinite(semi_axes) / np.minimum(depth, 1.0) + middle * np.isinf(semi_axes)
            string[half] = np.where(depth < 1, out, middle)
    return float(np.linalg.norm(np.diff(string, axis=0), axis=1).sum())


CYLINDER = "<radius>0.04</radius><length>1</length>"


@pytest.mark.parametrize(
    ("kind", "sizes", "semi_axes", "quadrant"),
    [
        ("WrapCylinder", CYLINDER, [0.04, 0.04, np.inf], "all"),
        ("WrapCylinder", CYLINDER, [0.04, 0.04, np.inf], "y"),
        ("WrapCylinder", CYLINDER, [0.04, 0.04, np.inf], "-y"),
        ("WrapSphere", "<radius>0.04</radius>", [0.04] * 3, "all"),
        ("WrapEllipsoid", "<dimensions>0.04 0.05 0.03</dimensions>", [0.04, 0.05, 0.03], "all"),
    ],
)
def test_a_path_round_a_surface_is_as_long_as_a_taut_string(limb, kind, sizes, semi_axes, quadrant):
    """Within 0.2 %; round an ellipsoid 1 %, since there it is kept in a plane."""
    place = f"<translation>0 -0.28 0</translation><quadrant>{quadrant}</quadrant>"
    surface = f'<{kind} name="ball">{place}{sizes}</{kind}>'
    limb.write_text(re.sub(r'<WrapSphere name="ball">.*?</WrapSphere>', surface, LIMB), encoding="latin-1")
    start, end = np.array([-0.07, 0.03, 0.02]), np.array([0.08, -0.04, -0.01])
    signs = {"all": (1, -1), "y": (1,), "-y": (-1,)}[quadrant]
    expected = min(taut(start, end, np.array(semi_axes), sign * np.array([0.0, 1.0, 0.0])) for sign in signs)
    assert lengths(limb)["over_ball"] == pytest.approx(
        expected, rel=0.01 if kind == "WrapEllipsoid" else 0.002
    )
    assert expected > 1.02 * np.linalg.norm(end - start)


# ---- OpenSim --------------------------------------------------------------------------------------------


BY_OPENSIM = """
import json, sys
import opensim
theirs, ours, factors = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
opensim.Logger.setLevelString("error")
model = opensim.Model(theirs)
state, scales = model.initSystem(), opensim.ScaleSet()
for name, three in factors.items():
    scale = opensim.Scale()
    scale.setSegmentName(name)
    scale.setScaleFactors(opensim.Vec3(*three))
    scale.setApply(True)
    scales.cloneAndAppend(scale)
model.scale(state, scales, True, model.getTotalMass(state))
model.printToXML(theirs)
model = opensim.Model(ours)
model.initSystem()
model.printToXML(ours)
"""  # in a process of its own: what one file calls a default, OpenSim takes for all that it reads later


def sizes_in(path: Path) -> dict[tuple[str, ...], np.ndarray]:
    """Numbers of all that has a size, by the names on the way to it."""
    found = {}

    def walk(node, names):
        for i, child in enumerate(node):
            if child.tag in (*PLACES, *LENGTHS) and (child.text or "").strip():
                found[(*names, child.tag)] = np.array(child.text.split(), dtype=float)
            walk(child, (*names, child.get("name") or f"{child.tag}{i}"))

    walk(fromstring(path.read_bytes()), ())
    return found


def assert_scaled_as_by_opensim(path: Path, tmp_path: Path, factors: dict[str, np.ndarray]) -> None:
    """Places and surfaces to 10⁻⁶ m, lengths of muscles and ligaments within 0.2 %."""
    pytest.importorskip("opensim")
    files = tmp_path / "theirs.osim", tmp_path / "ours.osim"
    files[0].write_bytes(path.read_bytes())
    files[1].write_bytes(own_model_content(path, at(load_skeleton(path), factors)))
    said = json.dumps({name: three.tolist() for name, three in factors.items()})
    subprocess.run([sys.executable, "-c", BY_OPENSIM, *map(str, files), said], check=True)
    theirs, ours = (sizes_in(file) for file in files)
    assert theirs.keys() == ours.keys()
    for names, value in theirs.items():
        if names[-1] in LENGTHS:
            np.testing.assert_allclose(ours[names], value, rtol=0.002, err_msg=str(names))
        elif not {"contactgeometryset", "markerset"} & {*names}:  # markers are where the fit has them
            np.testing.assert_allclose(ours[names], value, rtol=1e-5, atol=1e-6, err_msg=str(names))


@pytest.mark.opensim
def test_opensims_scale_tool_makes_the_same_of_the_limb(limb, tmp_path):
    limb.write_text(LIMB.replace("Zoë", "Zoe").replace("José", "Jose"))  # Python's OpenSim reads UTF-8 alone
    assert_scaled_as_by_opensim(limb, tmp_path, FACTORS)


@pytest.mark.opensim
@pytest.mark.real
def test_opensims_scale_tool_makes_the_same_of_all_kinds_of_models(model_files, tmp_path, subtests):
    """One of those that share muscles and what they wrap round."""
    rng, kinds = np.random.default_rng(3), {}
    for path in model_files:
        nodes = list(fromstring(path.read_bytes()).iter())
        paths = [n for n in nodes if n.tag.startswith("Wrap") or n.find("GeometryPath") is not None]
        if any(node.tag == "optimal_fiber_length" for node in nodes):
            kinds.setdefault(frozenset((node.tag, node.get("name")) for node in paths), path)
    assert len(kinds) > 5
    for path in kinds.values():
        with subtests.test(path.name):
            names = load_skeleton(path).body_names
            assert_scaled_as_by_opensim(path, tmp_path, {n: 1 + rng.uniform(-0.12, 0.12, 3) for n in names})
