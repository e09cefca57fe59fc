"""Sound stretches of real recordings, and how each is read."""

from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.faults.editor.recording import Recording, Trial, read_mot, read_trc


@dataclass(frozen=True)
class Stretch:
    """A part of one trial whose contacts are all on plates."""

    markers: str
    forces: str
    start_s: float
    end_s: float
    moments: str = "free"  # or "contradicting" the centres of pressure


@dataclass(frozen=True)
class Source:
    """A person's sound trials, handed out together."""

    name: str
    person: str  # folder of the recordings
    activity: str  # walk, run, jump, squat or stand
    stretches: tuple[Stretch, ...]
    mass_kg: float | None
    model: str | None = None
    static: str | None = None
    height_m: float | None = None
    sex: str | None = None

    def read(self, data: Path) -> Recording:
        """From the folder of all real recordings."""
        folder = data / self.person
        trials = []
        for k, stretch in enumerate(self.stretches):
            labels, positions, times = read_trc(folder / stretch.markers)
            plates, force_times = read_mot(folder / stretch.forces, stretch.moments)
            whole = Trial("ab"[k], labels, positions, times, plates, force_times)
            trials.append(whole.cut(stretch.start_s, stretch.end_s))
        return Recording(
            trials=tuple(replace(t, name=f"trial_{t.name}") for t in trials),
            mass_kg=self.mass_kg,
            height_m=self.height_m,
            sex=self.sex,
            model=folder / self.model if self.model else None,
            static=folder / self.static if self.static else None,
        )


SOURCES = (
    Source(
        "treadmill walk A",
        "walk_gait2354_subject01",
        "walk",
        (Stretch("subject01_walk1.trc", "subject01_walk1_grf.mot", 0.0, 2.5),),
        mass_kg=72.6,
        model="reference/subject01_simbody.osim",
        static="subject01_static.trc",
    ),
    Source(
        "walk over plates B",
        "walk_rajagopal2015",
        "walk",
        (Stretch("markers.trc", "grf.mot", 0.40, 2.04),),
        mass_kg=85.0668,
        height_m=1.829,
        model="unscaled_generic.osim",
        static="static_walk_2.trc",
    ),
    Source(
        "two treadmill walks A",
        "walk_gait2354_subject01",
        "walk",
        (
            Stretch("subject01_walk1.trc", "subject01_walk1_grf.mot", 0.0, 1.2),
            Stretch("subject01_walk1.trc", "subject01_walk1_grf.mot", 1.3, 2.5),
        ),
        mass_kg=72.6,
        model="reference/subject01_simbody.osim",
        static="subject01_static.trc",
    ),
    Source(
        "treadmill run C",
        "run_treadmill_hamner2013_subject04",
        "run",
        (Stretch("run400/markers.trc", "run400/grf.mot", 0.65, 2.73),),
        mass_kg=80.47,
        height_m=1.772,
        sex="male",
        model="unscaled_generic.osim",
    ),
    Source(
        "standing on two plates D",
        "overground_camargo2021_AB06",
        "stand",
        (
            Stretch(
                "levelground_ccw_fast_01_01.trc",
                "levelground_ccw_fast_01_01_grf.mot",
                2.0,
                4.0,
                "contradicting",
            ),
        ),
        mass_kg=78.1,
        model="unscaled_generic.osim",
    ),
    Source(
        "walk over plates E",
        "overground_falisse_AdDB",
        "walk",
        (Stretch("Gait_7_markers.trc", "Gait_7_grf.mot", 0.76, 1.64),),
        mass_kg=62.7,
    ),
    Source(
        "walk over plates F",
        "opencap_subject4",
        "walk",
        (Stretch("MarkerData/walking1.trc", "ForceData/walking1_grf.mot", 0.17, 1.28),),
        mass_kg=62.6,
        model="unscaled_generic.osim",
        static="MarkerData/static1.trc",
    ),
    Source(
        "two walks over plates F",
        "opencap_subject4",
        "walk",
        (
            Stretch("MarkerData/walking1.trc", "ForceData/walking1_grf.mot", 0.17, 1.28),
            Stretch("MarkerData/walkingTO1.trc", "ForceData/walkingTO1_grf.mot", 0.20, 1.36),
        ),
        mass_kg=62.6,
        model="unscaled_generic.osim",
        static="MarkerData/static1.trc",
    ),
    Source(
        "squats F",
        "opencap_subject4",
        "squat",
        (Stretch("MarkerData/squats1.trc", "ForceData/squats1_grf.mot", 0.1, 2.9),),
        mass_kg=None,
        model="unscaled_generic.osim",
        static="MarkerData/static1.trc",
    ),
    Source(
        "drop jump F",
        "opencap_subject4",
        "jump",
        (Stretch("MarkerData/DJ1.trc", "ForceData/DJ1_grf.mot", 1.06, 2.56),),
        mass_kg=62.6,
        model="unscaled_generic.osim",
        static="MarkerData/static1.trc",
    ),
    Source(
        "walk over plates G",
        "opencap_subject6",
        "walk",
        (Stretch("walking1.trc", "walking1_forces.mot", 0.20, 1.40),),
        mass_kg=None,
        model="unscaled_generic.osim",
        static="static1.trc",
    ),
    Source(
        "drop jump H",
        "opencap_reviewed",
        "jump",
        (Stretch("trials/DJ1/markers.trc", "trials/DJ1/grf.mot", 0.80, 2.18),),
        mass_kg=75.7,
        height_m=1.85,
        sex="male",
        model="unscaled_generic.osim",
    ),
    Source(
        "treadmill walk I",
        "exo_apo_gordon",
        "walk",
        (Stretch("S1_NE21_no_exo/NE21.trc", "S1_NE21_no_exo/NE21.mot", 0.03, 1.22),),
        mass_kg=75.6,
        model="body_without_device_mass.osim",
        static="S1_static/Static1.trc",
    ),
)
