"""Walks and runs with plates, read without the program: text files by their columns, C3D files by ezc3d."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import ezc3d
import numpy as np
from jaxtyping import Float

from benchmarks.faults.editor.recording import read_mot, read_trc
from benchmarks.recordings import data_folder

LEVEL_N = 20.0  # [N] vertical force of a contact
LEAST_PEAK_N = 150.0  # [N] a load that never reaches it is no step
SHORTEST_S = 0.06  # [s] nor is a shorter one
JOINED_S = 0.03  # [s] a foot that goes from plate to plate stands on
UNLOADED_N, UNLOADED_S = 30.0, 0.1  # [N, s] readings below tell the zero level, if there are so many


@dataclass(frozen=True)
class Recording:
    """A walk or run with plates, and which markers sit on its feet."""

    folder: str
    trial: str
    markers: str
    forces: str  # the same file, where a C3D holds both
    right: tuple[str, ...]
    left: tuple[str, ...]
    all_steps: bool = False  # whether plates measure every step of it
    pelvis: tuple[str, ...] = ()  # markers that tell the pace
    stands: bool = False  # whether the person also stands, in frames that do not count
    lone: bool = False  # a file without a subject's folder
    excluded: str = ""  # why its plates are no judge

    @property
    def name(self) -> str:
        """As in the table."""
        return self.markers.rpartition("/")[2] if self.lone else f"{self.folder} {self.trial}"


@dataclass(frozen=True)
class Step:
    """One stance on plates; None where the recording begins or ends in it. Times from the first frame [s]."""

    foot: str
    on_s: float | None
    off_s: float | None


EARLY = "the plates' clock is early against the cameras' (see the lag below)"

RECORDINGS = (
    Recording("walk_rajagopal2015", "walk", "markers.trc", "grf.mot",
              ("R.Heel", "R.MT5", "R.Toe"), ("L.Heel", "L.MT5", "L.Toe")),
    Recording("walk_gait2354_subject01", "walk1", "subject01_walk1.trc", "subject01_walk1_grf.mot",
              ("R.Heel", "R.Toe.Tip"), ("L.Heel", "L.Toe.Tip"), all_steps=True,
              pelvis=("R.ASIS", "L.ASIS", "V.Sacral")),
    Recording("walk_treadmill_stepwidth", "example1", "example1/markers.trc", "example1/grf.mot",
              ("RFCC", "RFM5", "RFM2"), ("LFCC", "LFM5", "LFM2"), all_steps=True,
              pelvis=("LIPS", "RIPS", "LIAS", "RIAS")),
    Recording("opencap_subject4", "walking1", "MarkerData/walking1.trc", "ForceData/walking1_grf.mot",
              ("r_calc", "r_5meta"), ("L_calc", "L_5meta")),
    Recording("opencap_subject4", "walkingTO1", "MarkerData/walkingTO1.trc", "ForceData/walkingTO1_grf.mot",
              ("r_calc", "r_5meta"), ("L_calc", "L_5meta")),
    Recording("opencap_subject6", "walking1", "walking1.trc", "walking1_forces.mot",
              ("r_calc", "r_5meta", "r_toe"), ("L_calc", "L_5meta", "L_toe")),
    Recording("overground_falisse_AdDB", "Gait_7", "Gait_7_markers.trc", "Gait_7_grf.mot",
              ("RHEE", "RTOE"), ("LHEE", "LTOE")),
    Recording("overground_camargo2021_AB06", "levelground_ccw_fast_01_01", "levelground_ccw_fast_01_01.trc",
              "levelground_ccw_fast_01_01_grf.mot", ("R_Heel", "R_Toe_Tip"), ("L_Heel", "L_Toe_Tip"),
              pelvis=("L_ASIS", "R_ASIS", "L_PSIS", "R_PSIS"), stands=True),
    Recording("c3d_lab_trials/lasem_FAILT01", "Walk01", "FAILT01_Walk01.c3d", "FAILT01_Walk01.c3d",
              ("RHEEL", "RTOE"), ("LHEEL", "LTOE")),
    Recording("anomalies/tiziana2019_lencioni", "trial", "markers.trc", "grf.mot",
              ("RxHeel", "RxToe1", "RxMeta5"), ("LxHeel", "LxToe1", "LxMeta5")),
    Recording("synthetic_arnold2013_subject01", "trial", "markers.trc", "grf.mot",
              ("RCAL", "RTOE", "RMT5"), ("LCAL", "LTOE", "LMT5"), all_steps=True,
              pelvis=("RASI", "LASI", "RPSI", "LPSI")),
    Recording("exo_apo_gordon", "NE21", "S1_NE21_no_exo/NE21.trc", "S1_NE21_no_exo/NE21.mot",
              ("R_Heel", "R_MTP1", "R_MTP5"), ("L_Heel", "L_MTP1", "L_MTP5"), all_steps=True,
              pelvis=("R_ASIS", "L_ASIS", "V_Sacral"), excluded=EARLY),
    Recording("exo_apo_gordon", "ET21", "S1_ET21_exo_transparent/ET21.trc",
              "S1_ET21_exo_transparent/ET21.mot", ("R_Heel", "R_MTP1", "R_MTP5"),
              ("L_Heel", "L_MTP1", "L_MTP5"), all_steps=True,
              pelvis=("R_ASIS", "L_ASIS", "V_Sacral"), excluded=EARLY),
    Recording("run_treadmill_hamner2013_subject04", "run400", "run400/markers.trc", "run400/grf.mot",
              ("RCAL", "RTOE", "RMT5"), ("LCAL", "LTOE", "LMT5"), all_steps=True,
              pelvis=("RASI", "LASI", "RPSI", "LPSI")),
    Recording("sprint_overground_dorn2012_JA1_9ms", "run0900cms", "run0900cms.trc", "sprint_grf.mot",
              ("RHEEL", "RTOE"), ("LHEEL", "LTOE")),
    Recording("sprint_overground_dorn2012_JA1_9ms", "JA1Gait35", "JA1Gait35.c3d", "JA1Gait35.c3d",
              ("RHEEL", "RTOE"), ("LHEEL", "LTOE")),
    Recording("c3d_conformance/btk_others", "walk", "ADemo1_rewrite_c3d_pc_integer.c3d",
              "ADemo1_rewrite_c3d_pc_integer.c3d", ("R.Heel", "R.Toe"), ("L.Heel", "L.Toe"), lone=True),
    Recording("c3d_conformance/c3dorg_sample02", "walk", "pc_real.c3d", "pc_real.c3d",
              ("RFT1", "RFT2", "RFT3"), ("LFT1", "LFT2", "LFT3"), lone=True),
    Recording("c3d_conformance/c3dorg_sample10", "walk", "type-2a.c3d", "type-2a.c3d",
              ("RHEE", "RTOE"), ("LHEE", "LTOE"), lone=True),
    Recording("c3d_conformance/ezc3d", "walk", "BTS.c3d", "BTS.c3d", ("r heel", "r met"), ("l heel", "l met"),
              lone=True),
)  # fmt: skip


@dataclass(frozen=True)
class Points:
    """Markers as the file has them, y up or z up."""

    times: Float[np.ndarray, " frames"]  # from the first frame [s]
    places: dict[str, Float[np.ndarray, "frames 3"]]  # [m]
    begin_s: float  # of the first frame, on the file's clock


@dataclass(frozen=True)
class Load:
    """One plate: its vertical force and where it acts, along the file's axes."""

    times: Float[np.ndarray, " samples"]  # from the first frame [s]
    vertical: Float[np.ndarray, " samples"]  # [N]
    centre: Float[np.ndarray, "samples 3"]  # [m]


def c3d_points(content: ezc3d.c3d) -> Points:
    """Markers of a C3D file."""
    parameters = content["parameters"]["POINT"]
    metres = 0.001 if parameters["UNITS"]["value"][0] == "mm" else 1.0
    points = content["data"]["points"][:3]
    header = content["header"]["points"]
    places = {
        name: metres * points[:, k].T
        for k, name in enumerate(parameters["LABELS"]["value"][: points.shape[1]])
    }
    rate = header["frame_rate"]
    return Points(np.arange(points.shape[2]) / rate, places, header["first_frame"] / rate)


def c3d_loads(content: ezc3d.c3d) -> list[Load]:
    """Plates of a C3D file at the rate of its analog channels."""
    rate = content["header"]["analogs"]["frame_rate"]
    loads = []
    for plate in content["data"]["platform"]:
        force = plate["force"]
        up = int(np.argmax(np.nanmax(np.abs(force), axis=1)))
        vertical = force[up] * np.sign(np.nansum(force[up]))
        metres = 0.001 if plate["unit_position"] == "mm" else 1.0
        loads.append(Load(np.arange(force.shape[1]) / rate, vertical, metres * plate["center_of_pressure"].T))
    return loads


def measured(recording: Recording) -> tuple[Points, list[Load]]:
    """Markers and plates, as recorded."""
    folder = data_folder() / recording.folder
    if recording.markers.endswith(".c3d"):
        content = ezc3d.c3d(str(folder / recording.markers), extract_forceplat_data=True)
        return c3d_points(content), c3d_loads(content)
    labels, positions, times = read_trc(folder / recording.markers)
    places = {label: positions[:, k] for k, label in enumerate(labels)}
    points = Points(times - times[0], places, float(times[0]))
    plates, force_times = read_mot(
        folder / recording.forces, "contradicting"
    )  # pressures as the file says them
    return points, [Load(force_times - times[0], plate.force[:, 1], plate.pressure) for plate in plates]


def steps_of(recording: Recording, points: Points, loads: Sequence[Load]) -> list[Step]:
    """Stances on plates, of the foot whose markers are nearest to the centre of pressure most of the time."""
    feet = {"right": recording.right, "left": recording.left}
    places = {foot: mean_of(points, names) for foot, names in feet.items()}
    found: list[Step] = []
    for load in loads:
        for on, off, loaded in _crossings(load):
            at = np.searchsorted(points.times, load.times[loaded]).clip(0, len(points.times) - 1)
            away = {
                foot: np.nanmedian(np.linalg.norm(place[at] - load.centre[loaded], axis=1))
                for foot, place in places.items()
            }
            found.append(Step(min(away, key=lambda foot: away[foot]), on, off))
    joined: list[Step] = []
    for step in sorted(found, key=lambda s: (s.foot, -np.inf if s.on_s is None else s.on_s)):
        last = joined[-1] if joined else None
        if last and last.foot == step.foot and (step.on_s or -np.inf) - (last.off_s or np.inf) < JOINED_S:
            off = None if last.off_s is None or step.off_s is None else max(last.off_s, step.off_s)
            joined[-1] = Step(step.foot, last.on_s, off)
        else:
            joined.append(step)
    return joined


def mean_of(points: Points, names: Sequence[str]) -> Float[np.ndarray, "frames 3"]:
    """Middle of the markers that are seen [m]."""
    places = np.array([points.places[name] for name in names])
    seen = np.isfinite(places)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(seen, places, 0.0).sum(axis=0) / seen.sum(axis=0))


def _crossings(load: Load) -> Iterator[tuple[float | None, float | None, slice]]:
    """Rises and falls through the level, between samples, and the samples between; zero level off."""
    step_s = load.times[1] - load.times[0]
    unloaded = load.vertical[np.abs(load.vertical) < UNLOADED_N]
    is_known = len(unloaded) * step_s > UNLOADED_S
    vertical = np.nan_to_num(load.vertical) - (np.median(unloaded) if is_known else 0.0)
    above = np.concatenate([[False], vertical > LEVEL_N, [False]])
    turns = np.flatnonzero(above[1:] != above[:-1])
    for first, end in zip(turns[::2], turns[1::2], strict=True):
        if (end - first) * step_s < SHORTEST_S or vertical[first:end].max() < LEAST_PEAK_N:
            continue

        def crossed(sample: int) -> float:
            rise = vertical[sample] - vertical[sample - 1]
            return float(load.times[sample - 1] + (LEVEL_N - vertical[sample - 1]) / rise * step_s)

        on = crossed(first) if first > 0 else None
        off = crossed(end) if end < len(vertical) else None
        yield on, off, slice(first, end)
