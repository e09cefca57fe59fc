"""Muscles of Rajagopal 2016 on the default body: places on the bones, lengths as OpenSim has them."""

import re

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.added_muscles import with_muscles_of
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import write_skeleton


@pytest.mark.real
def test_the_default_body_gets_all_muscles_and_moves_as_before(real_data, tmp_path):
    model, body = real_data / "models" / "Rajagopal2016.osim", default_skeleton(mass_kg=75.0, height_m=1.8)
    text = with_muscles_of(model, body)
    (tmp_path / "with.osim").write_text(text)
    write_skeleton(body, tmp_path / "without.osim")
    assert load_skeleton(tmp_path / "with.osim").bodies[5].mass == body.bodies[5].mass
    for kind, count in (("<Millard2012EquilibriumMuscle name=", 81), ("<WrapCylinder name=", 40)):
        assert text.count(kind) == model.read_text().count(kind) == count  # a default among the muscles
    size = body.bodies[body.body_index("femur_r")].geometry[0].scale
    places = re.compile(r'(?s)name="addlong_r-P2".*?<location>([^<]*)<')
    theirs, ours = (np.array(places.search(t)[1].split(), dtype=float) for t in (model.read_text(), text))
    np.testing.assert_allclose(ours, size * theirs)


@pytest.mark.real
def test_models_that_cannot_give_muscles_are_told(real_data, tmp_path):
    body = default_skeleton()
    write_skeleton(body, tmp_path / "bare.osim")
    for path, why in (
        (tmp_path / "bare.osim", "has no muscles"),
        (real_data / "models" / "gait2354_osim23_format.osim", "save it"),
        (
            real_data / "run_treadmill_hamner2013_subject04" / "unscaled_generic.osim",
            "'glut_med1_r-P2': it is on 'femur_r', which the skeleton lacks or draws by",
        ),
    ):
        with pytest.raises(ModelError, match=why):
            with_muscles_of(path, body)


@pytest.mark.opensim
@pytest.mark.real
def test_fibres_grow_as_opensim_measures_the_paths(real_data, tmp_path):
    opensim = pytest.importorskip("opensim")
    opensim.Logger.setLevelString("error")
    model = real_data / "models" / "Rajagopal2016.osim"
    (tmp_path / "with.osim").write_text(with_muscles_of(model, default_skeleton(height_m=1.8)))
    found = []
    for path in (model, tmp_path / "with.osim"):
        read = opensim.Model(str(path))
        state = read.initSystem()
        muscles = [read.getMuscles().get(i) for i in range(read.getMuscles().getSize())]
        found.append({m.getName(): (m.getLength(state), m.getOptimalFiberLength()) for m in muscles})
    assert len(found[0]) == 80
    before, after = (np.array([one[name] for name in found[0]]) for one in found)
    np.testing.assert_allclose(after[:, 1] / before[:, 1], after[:, 0] / before[:, 0], rtol=0.002)
    assert np.ptp(after[:, 0] / before[:, 0]) > 0.05
