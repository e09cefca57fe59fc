"""A subject's folder into which trials are written, and judges that cost nothing."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from addb_viewer.watch import judging
from addb_viewer.watch.judging import FirstLook, FitLook, Look
from addb_viewer.watch.watching import Session
from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from solver.common.errors import FitError
from tests.addb_viewer.fit_figures import force, of_trial

SOUND = Look((), (), True, True)


@pytest.fixture
def recording(tmp_path_factory):
    """Bytes of markers that move, and of forces beside them; another number, another trial."""

    scratch = tmp_path_factory.mktemp("made")

    def made(number=0, frames=60, moving=1.0):
        rng = np.random.default_rng(number)
        along = moving * np.linspace(0, 2, frames)[:, None, None] * [1.0, 0.0, 0.0]
        places = rng.uniform(0.2, 1.6, (1, 6, 3)) + along
        write_trc(scratch / "made.trc", Markers(tuple("ABCDEF"), places, 100.0))
        rows = "\n".join(f"{k / 100:.2f}\t0\t{700 + number}\t0\t0\t0\t0\t0\t0\t0" for k in range(frames))
        names = "\t".join(f"ground_force_{kind}{axis}" for kind in "vpm" for axis in "xyz")
        forces = f"grf\nnRows={frames}\nnColumns=10\nendheader\ntime\t{names}\n{rows}\n"
        return (scratch / "made.trc").read_bytes(), forces.encode()

    return made


@pytest.fixture
def put(recording):
    """Write a trial whole."""

    def written(folder, name, number=0):
        folder.mkdir(exist_ok=True)
        markers, forces = recording(number)
        (folder / f"{name}_grf.mot").write_bytes(forces)
        (folder / f"{name}.trc").write_bytes(markers)

    return written


@pytest.fixture
def judges(monkeypatch):
    """What is asked of the judges, by stage; each answers at once. A trial called `bad` cannot be fitted."""
    asked = []

    def first(folder, name, former):
        asked.append(("first", name))
        return FirstLook(SOUND, (), ())

    def fit(folder, name, model):
        asked.append(("fit", name))
        if name == "bad":
            raise FitError("no markers shared with the model")
        return FitLook(
            SOUND, of_trial(name=name, marker_rms_m=0.01, linear_residual=force(9.0, 0.01)), (), "walk"
        )

    def diagnosis(folder, name, place, model):
        raise FitError("nothing can be diagnosed")

    for name, judge in (("first_look", first), ("fit_look", fit), ("diagnosis_of", diagnosis)):
        monkeypatch.setattr(judging, name, judge)
    monkeypatch.setattr(Session, "_new_pool", lambda self: ThreadPoolExecutor(2))
    return asked
