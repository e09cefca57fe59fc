import unicodedata
from pathlib import PurePath

import pytest

from solver.capture.subject.trial_names import Relation, name_tokens, relation


@pytest.mark.parametrize(
    ("one", "other", "found"),
    [
        ("motion_capture_run.trc", "grf_run.mot", Relation.SAME),
        ("WALK01.trc", "WALK01_kinetics.mot", Relation.SAME),
        ("trans_1_kine.trc", "trans_1_grf.mot", Relation.SAME),
        ("markers.trc", "GRF.mot", Relation.SAME),
        ("MotionCapture Walk-01.trc", "walk 1 (forces).mot", Relation.SAME),
        ("walkMarkers.trc", "walkgrf.mot", Relation.SAME),
        ("Läufer_groß.trc", "laeufer gross Kraefte.mot", Relation.SAME),
        ("trial 7.C3D", "Trial07_ForcePlates.mot", Relation.SAME),
        ("MarkerData/DJ1.trc", "ForceData/DJ1_grf.mot", Relation.SAME),
        ("walk1/markers.trc", "forces/walk1.mot", Relation.SAME),
        ("walk1.trc", "walk10_grf.mot", Relation.SIBLINGS),
        ("walk_1_2.trc", "walk_12_grf.mot", Relation.SIBLINGS),
        ("0001.trc", "0002.mot", Relation.SIBLINGS),
        ("walk_fast.trc", "walk_slow_grf.mot", Relation.SIBLINGS),
        ("days/walk1/markers.trc", "days/walk2/grf.mot", Relation.SIBLINGS),
        ("S01_walk1.trc", "walk1_forces.mot", Relation.PART),
        ("A01_PREF_T0015.trc", "A01_T0015_GRF_2plates.mot", Relation.PART),
        ("A01_PREF_T0015.trc", "A01_T0016_GRF_2plates.mot", Relation.SIBLINGS),
        ("run0350cms.trc", "jog_grf.mot", Relation.UNRELATED),
        ("trial 3.trc", "run 3.mot", Relation.UNRELATED),
        ("walk.trc", "forces.mot", Relation.UNRELATED),
        ("day1/jog_kine.trc", "day1/run0350.mot", Relation.UNRELATED),
    ],
)
def test_what_two_names_say(one, other, found):
    assert relation(PurePath(one), PurePath(other)) is found
    assert relation(PurePath(other), PurePath(one)) is found


def test_an_umlaut_is_the_same_however_the_disk_writes_it():
    composed = "Sprünge_für_Jörg"
    assert name_tokens(composed) == name_tokens(unicodedata.normalize("NFD", composed)) != ()
