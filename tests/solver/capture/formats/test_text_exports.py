"""Text of capture programs, written here by other code, read back; and one bad line told by file and line."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from solver.capture.capture import TrialFiles
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError
from solver.export.conversion.convert import convert

NAMES = ("Head", "L_Shoulder", "R_Shoulder", "L_Hip", "R_Hip", "L_Heel", "L_Toe", "R_Heel", "R_Toe")
PLACES = np.array(
    [
        *([0, 0, 1.7], [0, 0.2, 1.4], [0, -0.2, 1.4], [0, 0.1, 0.9], [0, -0.1, 0.9]),
        *([-0.05, 0.1, 0.04], [0.15, 0.1, 0.03], [-0.05, -0.1, 0.04], [0.15, -0.1, 0.03]),
    ]
)
FRAMES, RATE, TIMES = 60, 100.0, 10  # samples of plates a frame
WEIGHT_N = 700.0
Z_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # R_ground_lab
SLOW = settings(
    max_examples=15,
    deadline=None,
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=list(HealthCheck),
)


def positions() -> np.ndarray:
    """Somebody who bobs on the spot, in metres, z up."""
    t = np.arange(FRAMES) / RATE
    bob = np.stack([0.02 * np.sin(3 * t), 0.01 * np.cos(3 * t), 0.02 * np.cos(6 * t)], axis=1)
    return PLACES + bob[:, None] * (PLACES[:, 2:] > 0.5)


def load_of(foot: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, centre of pressure and free moment on the left (0) or right (1) foot, a row a sample."""
    n = FRAMES * TIMES
    t = np.arange(n) / (RATE * TIMES)
    vertical = WEIGHT_N * 0.5 * (1 + (1 - 2 * foot) * 0.5 * np.cos(6 * t))
    force = np.stack([0.05 * vertical, 0.02 * vertical * np.sin(9 * t), vertical], axis=1)
    point = np.stack([0.02 + 0.05 * np.sin(4 * t), np.full(n, (0.1, -0.1)[foot]), np.zeros(n)], axis=1)
    return force, point, 3.0 * np.sin(5 * t)


def number(value: float, comma: bool, missing: str) -> str:
    return missing if np.isnan(value) else f"{value:.6f}".replace(".", "," if comma else ".")


@st.composite
def dialects(draw) -> dict:
    """How a table is written."""
    comma = draw(st.booleans())
    return {
        "comma": comma,
        "separator": ";" if comma else draw(st.sampled_from(["\t", ";"])),
        "end": draw(st.sampled_from(["\n", "\r\n"])),
        "encoding": draw(st.sampled_from(["utf-8", "utf-8-sig", "latin-1", "utf-16"])),
        "padding": draw(st.sampled_from([0, 1, 40])),
        "missing": draw(st.sampled_from(["0.000", "", "NaN"])),
    }


def save(path: Path, rows: list, how: dict) -> None:
    lines = [how["separator"].join(map(str, row)) + how["separator"] * how["padding"] for row in rows]
    path.write_bytes((how["end"].join(lines) + how["end"]).encode(how["encoding"]))


def write_qtm_markers(path: Path, lab: np.ndarray, how: dict, lead: str = "ft", names=NAMES, **head) -> None:
    rows = [
        ["NO_OF_FRAMES", len(lab)], ["NO_OF_MARKERS", len(names)], ["FREQUENCY", f"{RATE:g}"],
        ["DESCRIPTION", "Müller"], ["DATA_INCLUDED", "3D"],
        *([["EVENT", "heel strike", 12, 0.11]] if head.get("events") else []),
        ["MARKER_NAMES", *names],
    ]  # fmt: skip
    if head.get("types"):
        rows.append(["TRAJECTORY_TYPES", *head["types"]])
    if head.get("columns"):
        first = [{"f": "Frame", "t": "Time"}[letter] for letter in lead]
        rows.append([*first, *(f"{name} {axis}" for name in names for axis in "XYZ")])
    for k, frame in enumerate(lab.reshape(len(lab), -1) * 1000):
        before = {"f": str(k + 501), "t": number((k + 500) / RATE, how["comma"], "")}
        rows.append([*(before[x] for x in lead), *(number(v, how["comma"], how["missing"]) for v in frame)])
    save(path, rows, how)


def write_qtm_plate(
    path: Path, foot: int, how: dict, *, turn: float, depth: float, lead="ft", **head
) -> None:
    """A plate's file in its own axes, z down, turned about the vertical; what acts on the plate."""
    force, point, free = load_of(foot)
    middle = np.array([0.05, (0.1, -0.1)[foot], 0.0])
    x = np.array([np.cos(turn), np.sin(turn), 0.0])
    axes = np.stack([x, np.cross([0, 0, -1.0], x), [0, 0, -1.0]], axis=1)  # columns
    sensor = middle + axes @ [0.0, 0.0, depth]
    moment = np.cross(point - sensor, force) + np.outer(free, [0, 0, 1.0])
    columns = np.hstack([-force @ axes, -moment @ axes, ((point - middle) @ axes) * 1000])
    columns[force[:, 2] == 0, 6:] = 0.0
    rows = [
        ["NO_OF_SAMPLES", len(force)], ["FREQUENCY", f"{RATE * TIMES:g}"],
        ["DESCRIPTION", "Force data in local (force plate) coordinates"], ["DATA_INCLUDED", "Force"],
        ["FORCE_PLATE_NAME", f"Plate-{foot + 1}"],
    ]  # fmt: skip
    for name, sx, sy in (
        ("POSX_POSY", 1, 1),
        ("NEGX_POSY", -1, 1),
        ("NEGX_NEGY", -1, -1),
        ("POSX_NEGY", 1, -1),
    ):
        corner = (middle + axes @ [0.25 * sx, 0.2 * sy, 0.0]) * 1000
        rows += [
            [f"FORCE_PLATE_CORNER_{name}_{axis}", number(v, how["comma"], "")]
            for axis, v in zip("XYZ", corner, strict=True)
        ]
    if head.get("columns"):
        first = [{"f": "Sample", "t": "Time"}[letter] for letter in lead]
        rows.append([*first, *(f"{v}_{axis}" for v in ("Force", "Moment", "COP") for axis in "XYZ")])
    for k, row in enumerate(columns):
        before = {"f": str(k + 501), "t": number(5.0 + k / RATE / TIMES, how["comma"], "")}
        rows.append([*(before[x] for x in lead), *(number(v, how["comma"], "") for v in row)])
    save(path, rows, how)


def write_nexus(path: Path, lab: np.ndarray, how: dict, order: str, first: int = 1) -> None:
    """Sections in the order of the letters: T trajectories, D devices, M model outputs."""
    rows: list[list] = []
    for section in order:
        if section == "T":
            rows += [["Trajectories"], [f"{RATE:g}"]]
            rows.append(["", "", *(x for name in NAMES for x in ("Anna:" + name, "", ""))])
            rows += [["Frame", "Sub Frame", *("XYZ" * len(NAMES))], ["", "", *["mm"] * 3 * len(NAMES)]]
            for k, frame in enumerate(lab.reshape(len(lab), -1) * 1000):
                rows.append([first + k, 0, *(number(v, how["comma"], "") for v in frame)])
        if section == "D":
            loads = [load_of(foot) for foot in (0, 1)]
            blocks = []
            for foot, (force, point, free) in enumerate(loads):
                middle = np.array([0.05, (0.1, -0.1)[foot], 0.0])
                moment = np.cross(point - middle, force) + np.outer(free, [0, 0, 1.0])
                blocks.append(np.hstack([force, moment * 1000, point * 1000]))
            device = "Imported AMTI OR6 Series Force Plate #"
            names = [f"{device}{k} - {what}" for k in (1, 2) for what in ("Force", "Moment", "CoP")]
            rows += [
                ["Devices"],
                [f"{RATE * TIMES:g}"],
                ["", "", *(x for n in names for x in (n, "", "")), "EMG"],
            ]
            rows.append(
                ["Frame", "Sub Frame", *["Fx", "Fy", "Fz", "Mx", "My", "Mz", "Cx", "Cy", "Cz"] * 2, "v"]
            )
            rows.append(["", "", *["N", "N", "N", "N.mm", "N.mm", "N.mm", "mm", "mm", "mm"] * 2, "V"])
            for k, row in enumerate(np.hstack(blocks)):
                cells = (number(v, how["comma"], "") for v in row)
                rows.append([first + k // TIMES, k % TIMES, *cells, number(0.01, how["comma"], "")])
        if section == "M":
            rows += [["Model Outputs"], [f"{RATE:g}"], ["", "", "Anna:LKneeAngles", "", ""]]
            rows += [["Frame", "Sub Frame", "X", "Y", "Z"], ["", "", "deg", "deg", "deg"]]
            rows += [[first + k, 0, 1, 2, 3] for k in range(FRAMES)]
        rows.append([])
    save(path, rows, how)


def write_motive(path: Path, lab: np.ndarray, how: dict, metres: float, kinds: tuple[str, ...]) -> None:
    """A take, y up: a rigid body with quaternions, its markers where the software put them, and seen ones."""
    up = lab @ Z_UP.T / metres
    columns: list[tuple[str, str, str, str, np.ndarray]] = []
    for axis in "XYZW":
        columns.append(("Rigid Body", "Pelvis", "Rotation", axis, np.full(FRAMES, 0.5)))
    for kind in kinds:
        shift = 0.0 if kind == "Marker" else 0.01 / metres
        columns += [
            (kind, f"Anna:{name}", "Position", axis, up[:, k, i] + shift)
            for k, name in enumerate(NAMES)
            for i, axis in enumerate("XYZ")
        ]
        columns.append((kind, "Anna:Head", "Marker Quality", "", np.ones(FRAMES)))
    columns += [("Marker", "Unlabeled 1012", "Position", axis, np.ones(FRAMES)) for axis in "XYZ"]
    unit = {1.0: "Meters", 0.01: "Centimeters", 0.001: "Millimeters"}[metres]
    head = ["Format Version", "1.23", "Take Name", "t", "Capture Frame Rate", number(RATE, how["comma"], "")]
    rows: list[list] = [[*head, "Rotation Type", "Quaternion", "Length Units", unit], []]
    rows += [["", "Type", *(c[0] for c in columns)], ["", "Name", *(c[1] for c in columns)]]
    rows += [["", "ID", *(k for k in range(len(columns)))], ["", "", *(c[2] for c in columns)]]
    rows.append(["Frame", "Time (Seconds)", *(c[3] for c in columns)])
    for k in range(FRAMES):
        cells = (number(c[4][k], how["comma"], "") for c in columns)
        rows.append([k, number(k / RATE, how["comma"], ""), *cells])
    save(path, rows, how)


def check_markers(trial, lab: np.ndarray) -> None:
    assert trial.markers.names == NAMES
    assert trial.markers.rate == pytest.approx(RATE, rel=1e-6)
    np.testing.assert_allclose(trial.markers.positions_ground, lab @ Z_UP.T, atol=1e-6)


def check_plates(trial) -> None:
    assert len(trial.plates) == 2
    for foot, plate in enumerate(trial.plates):
        force, point, free = load_of(foot)
        moment = np.cross(point, force) + np.outer(free, [0, 0, 1.0])
        assert plate.rate == pytest.approx(RATE * TIMES, rel=1e-6)
        assert plate.start_time == pytest.approx(trial.markers.start_time, abs=1e-6)
        np.testing.assert_allclose(plate.force_ground, force @ Z_UP.T, atol=1e-4)
        np.testing.assert_allclose(plate.moment_ground, moment @ Z_UP.T, atol=0.5)  # a millimetre of lever
        loaded = force[:, 2] > 50
        np.testing.assert_allclose(plate.cop_ground[loaded], point[loaded] @ Z_UP.T, atol=1e-5)


def with_gap(lab: np.ndarray, gap: tuple[int, int, int]) -> np.ndarray:
    marker, start, length = gap
    lab = lab.copy()
    lab[start : start + length, marker] = np.nan
    return lab


GAPS = st.tuples(st.integers(0, len(NAMES) - 1), st.integers(0, 50), st.integers(0, 9))


@SLOW
@given(
    how=dialects(),
    gap=GAPS,
    head=st.fixed_dictionaries({"lead": st.sampled_from(["", "f", "ft"]), "columns": st.booleans()}),
    plates=st.tuples(st.floats(-np.pi, np.pi), st.floats(-0.06, 0.06), st.sampled_from(["", " (2)", "(1)"])),
)
def test_qtm_is_read_back(tmp_path_factory, how, gap, head, plates):
    folder = tmp_path_factory.mktemp("qtm")
    lab = with_gap(positions(), gap)
    turn, depth, mark = plates
    types = ["Measured", "Mixed"] * 4 + ["Gap-filled"]
    write_qtm_markers(folder / f"gait{mark}.tsv", lab, how, events=True, types=types, **head)
    for foot in (0, 1):
        plate = folder / f"gait_f_{foot + 1}{mark}.tsv"
        write_qtm_plate(plate, foot, how, turn=turn + foot, depth=depth, **head)
    subject = open_subject(folder)
    (files,) = subject.trials
    assert subject.unused == ()
    trial = read_trial(files)
    check_markers(trial, lab)
    check_plates(trial)
    assert len(trial.files) == 3
    assert all(plate.corners_ground is not None for plate in trial.plates)
    assert any(f"gait_f_2{mark}.tsv" in note for note in trial.notes)


@SLOW
@given(
    how=dialects().filter(lambda how: how["padding"] < 40), gap=GAPS, order=st.permutations("TDM"),
    first=st.sampled_from([1, 301]),
)  # fmt: skip
def test_nexus_is_read_back(tmp_path_factory, how, gap, order, first):
    folder = tmp_path_factory.mktemp("nexus")
    lab = with_gap(positions(), gap)
    write_nexus(folder / "gait.csv", lab, how, "".join(order), first)
    (files,) = open_subject(folder).trials
    trial = read_trial(files)
    check_markers(trial, lab)
    check_plates(trial)
    assert any("model outputs" in note for note in trial.notes)


@SLOW
@given(
    how=dialects(), gap=GAPS, metres=st.sampled_from([1.0, 0.01, 0.001]),
    kinds=st.sampled_from([("Marker",), ("Bone Marker", "Marker"), ("Rigid Body Marker", "Marker")]),
)  # fmt: skip
def test_motive_is_read_back_from_what_cameras_saw(tmp_path_factory, how, gap, metres, kinds):
    folder = tmp_path_factory.mktemp("motive")
    lab = with_gap(positions(), gap)
    write_motive(folder / "Take 1.csv", lab, how, metres, kinds)
    (files,) = open_subject(folder).trials
    check_markers(read_trial(files), lab)


HOW = {"comma": False, "separator": "\t", "end": "\n", "encoding": "utf-8", "padding": 0, "missing": "0.000"}
CSV = {**HOW, "separator": ",", "missing": ""}


def written(folder: Path, program: str) -> Path:
    if program == "qtm":
        write_qtm_markers(folder / "gait.tsv", positions(), HOW)
        return folder / "gait.tsv"
    if program == "plate":
        write_qtm_markers(folder / "gait.tsv", positions(), HOW)
        for foot in (0, 1):
            write_qtm_plate(folder / f"gait_f_{foot + 1}.tsv", foot, HOW, turn=0.3, depth=0.04)
        return folder / "gait_f_2.tsv"
    if program == "motive":
        write_motive(folder / "gait.csv", positions(), CSV, 1.0, ("Marker",))
    else:
        write_nexus(folder / "gait.csv", positions(), CSV, "TD")
    return folder / "gait.csv"


@pytest.mark.parametrize("program", ["qtm", "plate", "nexus", "motive"])
@pytest.mark.parametrize("bad", ["12.3x", "überall"])
def test_one_bad_line_is_told_by_file_and_line(tmp_path, program, bad):
    path = written(tmp_path, program)
    lines = path.read_text().split("\n")
    place = next(k for k in range(len(lines) - 20, 0, -1) if lines[k][:1].isdigit())
    separator = "\t" if path.suffix == ".tsv" else ","
    cells = lines[place].split(separator)
    cells[4] = bad
    lines[place] = separator.join(cells)
    path.write_text("\n".join(lines))
    with pytest.raises(
        CaptureError, match=rf"{path.name}: line {place + 1}, column .*'{bad}' is not a number"
    ):
        read_trial(open_subject(tmp_path).trials[0])


@pytest.mark.parametrize("program", ["qtm", "plate", "nexus", "motive"])
def test_a_file_that_is_cut_off_is_told(tmp_path, program):
    path = written(tmp_path, program)
    path.write_text(path.read_text()[:-40])
    with pytest.raises(CaptureError, match=rf"{path.name}: line \d+: the file is cut off inside this row"):
        read_trial(open_subject(tmp_path).trials[0])


def test_points_that_qtm_computed_are_no_markers(tmp_path):
    types = ["Virtual", *["Measured"] * 8]
    write_qtm_markers(tmp_path / "gait.tsv", positions(), HOW, types=types)
    trial = read_trial(TrialFiles("gait", tmp_path / "gait.tsv"))
    assert trial.markers.names == NAMES[1:]
    assert any("computed quantities, not markers: Head" in note for note in trial.notes)


def test_without_seen_markers_the_placed_ones_are_read_and_told(tmp_path):
    write_motive(tmp_path / "gait.csv", positions(), CSV, 1.0, ("Bone Marker",))
    trial = read_trial(open_subject(tmp_path).trials[0])
    check_markers(trial, positions() + np.array([0.01, -0.01, 0.01]))
    assert any("no markers as cameras saw them" in note for note in trial.notes)


def test_forces_in_a_file_of_their_own_are_paired_with_nexus_trajectories(tmp_path):
    write_nexus(tmp_path / "gait_trajectories.csv", positions(), CSV, "T")
    write_nexus(tmp_path / "gait_devices.csv", positions(), CSV, "D")
    (files,) = open_subject(tmp_path).trials
    assert files.forces is not None
    trial = read_trial(files)
    check_markers(trial, positions())
    check_plates(trial)


def test_copies_of_a_cloud_are_one_trial(tmp_path):
    for mark in (" (2)", " (2)(1)"):
        write_qtm_markers(tmp_path / f"gait{mark}.tsv", positions(), HOW)
        for foot in (0, 1):
            write_qtm_plate(tmp_path / f"gait_f_{foot + 1}{mark}.tsv", foot, HOW, turn=0.3, depth=0.04)
    subject = open_subject(tmp_path)
    assert [trial.markers.name for trial in subject.trials] == ["gait (2).tsv"]
    assert len(subject.unused) == 3
    assert all("a copy of gait" in file.reason for file in subject.unused)


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("drop jump.xlsx", b"PK\3\4", "a spreadsheet; export the recording as C3D"),
        ("session.txt", b"% TimeStamp\tRHEE.PosX\tFP2.ForY\n0.1\t1\t2\n", r"text of D-Flow \(Motek\)"),
        ("gait_6D.tsv", b"NO_OF_FRAMES\t3\nDATA_INCLUDED\t6D\nx\n", r"Track Manager \(6D\), without markers"),
        (
            "angles.csv",
            b"Model Outputs\n100\n,,LKnee\nFrame,Sub Frame,X\n1,0,2\n",
            r"Nexus \(model outputs\)",
        ),
        ("a.qtm", b"x", "export it there as C3D, or as TSV"),
        ("a.x1d", b"x", "reconstruct and label"),
        ("a.anc", b"x", "export the forces in a C3D"),
        ("a.zip", b"x", "an archive; unpack it"),
        ("a.avi", b"x", "a video; markers are needed"),
        ("a.npy", b"x", "arrays of a kind"),
        ("a.vsk", b"x", "without a motion"),
    ],
)
def test_without_trials_every_file_of_a_kind_is_named_with_what_to_do(tmp_path, name, content, told):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / name).write_bytes(content)
    with pytest.raises(CaptureError, match=rf"no trials\..* sub/{name}: .*{told}"):
        open_subject(tmp_path)


def test_convert_reads_them(tmp_path):
    written(tmp_path, "plate")
    for source in ("gait.tsv", "gait_f_1.tsv"):
        target = tmp_path / "out" / f"{Path(source).stem}.{'c3d' if source == 'gait.tsv' else 'mot'}"
        convert(tmp_path / source, target)
    trial = read_trial(TrialFiles("t", tmp_path / "out" / "gait.c3d"))
    np.testing.assert_allclose(trial.markers.positions_ground, positions() @ Z_UP.T, atol=1e-5)
    np.testing.assert_allclose(trial.plates[0].force_ground[:, 1], load_of(0)[0][:, 2], atol=0.1)
    both = read_trial(TrialFiles("t", tmp_path / "gait.tsv", tmp_path / "out" / "gait_f_1.mot"))
    np.testing.assert_allclose(both.plates[1].force_ground[:, 1], load_of(1)[0][:, 2], atol=0.1)


LISBON = {  # seconds of the loads of 20 N and more, by plate, read from the numbers by other code
    "trial_0010_Run": [(21.870, 22.235), (22.280, 22.595), (22.655, 22.975)],
    "trial_0013_G2": [(15.805, 15.945), (15.865, 16.465), (16.385, 16.960)],
}


def test_a_time_history_of_qtm_text_is_read_with_its_forces_under_the_feet(real_data, tmp_path):
    shutil.copytree(real_data / "wild/lisbon_qtm_tsv", tmp_path / "lisbon")
    subject = open_subject(tmp_path / "lisbon")
    assert {trial.name for trial in subject.trials} == set(LISBON)
    assert subject.static is not None
    assert subject.static.name == "trial_0001_static.tsv"
    for files in subject.trials:
        trial = read_trial(files)
        assert not any("do NOT lie under" in note for note in trial.notes)
        feet = [
            k for k, name in enumerate(trial.markers.names) if any(w in name for w in ("Heel", "Toe", "Meta"))
        ]
        for plate, (start, end) in zip(trial.plates, LISBON[files.name], strict=True):
            loaded = plate.force_ground[:, 1] > 20
            assert plate.times[loaded][[0, -1]] == pytest.approx([start, end], abs=0.011)
            strong = plate.force_ground[:, 1] > 200
            frames = np.round((plate.times[strong] - trial.markers.start_time) * trial.markers.rate).astype(
                int
            )
            away = np.linalg.norm(
                (trial.markers.positions_ground[frames][:, feet] - plate.cop_ground[strong, None])[
                    ..., [0, 2]
                ],
                axis=2,
            )
            assert np.median(away.min(axis=1)) < 0.12
