from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.trc import read_trc
from solver.markers.atlas import atlas, landmark_marker
from solver.markers.understanding import understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions


def labels(text):
    """Names that stand in one text, between commas or else spaces."""
    return text.split("," if "," in text else None)


PLUG_IN_GAIT = labels(
    "LFHD RFHD LBHD RBHD C7 T10 CLAV STRN RBAK LSHO LUPA LELB LFRM LWRA LWRB LFIN RSHO "
    "RUPA RELB RFRM RWRA RWRB RFIN LASI RASI LPSI RPSI LTHI LKNE LTIB LANK LHEE LTOE RTHI "
    "RKNE RTIB RANK RHEE RTOE"
)
BY_FAMILY = {
    "Plug-in Gait": (
        labels(
            "LFHD,RFHD,LBHD,RBHD,C7,T10,CLAV,STRN,RBAK,LSHO,LUPA,LELB,LFRM,LWRA,LWRB,LFIN,RSHO,"
            "RUPA,RELB,RFRM,RWRA,RWRB,RFIN,LASI,RASI,LPSI,RPSI,LTHI,LKNE,LTIB,LANK,LHEE,LTOE,RTHI,"
            "RKNE,RTIB,RANK,RHEE,RTOE"
        ),
        {"LTIB": "shank_wand_l", "LASI": "asis_l", "RBAK": "back_offset", "RTOE": "mt2_head_r"},
    ),
    "OptiTrack": (
        labels(
            "HeadTop HeadFront BackTop ChestTop ChestLow LShoulderTop RShoulderTop LUArmHigh RUArmHigh "
            "LElbowOut RElbowOut LFArm RFArm LWristOut RWristOut WaistLFront WaistRFront WaistLBack "
            "WaistCBack WaistRBack LKneeOut RKneeOut "
            "LShin RShin LAnkleOut RAnkleOut LHeel RHeel LToeIn RToeIn LToeOut RToeOut LToeTip RToeTip"
        ),
        {
            "LFArm": "forearm_l",
            "WaistCBack": "sacrum",
            "WaistRBack": "psis_r",
            "ChestLow": "sternum_middle",
            "LToeOut": "mt5_head_l",
        },
    ),
    "video keypoints": (
        labels(
            "Hip RHip RKnee RAnkle RBigToe RSmallToe RHeel LHip LKnee LAnkle LBigToe LSmallToe LHeel Neck "
            "Head Nose RShoulder RElbow RWrist LShoulder LElbow LWrist"
        ),
        {
            "RHip": "hip_centre_r",
            "LKnee": "knee_centre_l",
            "RAnkle": "ankle_centre_r",
            "LElbow": "elbow_centre_l",
            "RSmallToe": "mt5_head_r",
        },
    ),
    "Cleveland Clinic": (
        labels(
            "R.ASIS,L.ASIS,V.Sacral,R.Thigh.Upper,R.Thigh.Front,R.Thigh.Rear,L.Thigh.Upper,"
            "L.Thigh.Front,L.Thigh.Rear,R.Knee.Lat,L.Knee.Lat,R.Shank.Upper,L.Shank.Upper,R.Heel,"
            "L.Heel,R.Toe.Lat,L.Toe.Lat,R.Acromium,L.Acromium"
        ),
        {"V.Sacral": "sacrum", "R.Thigh.Rear": "thigh_rear_r", "L.Toe.Lat": "mt5_head_l"},
    ),
    "CAST / IOR (Rizzoli)": (
        labels(
            "LIAS,RIAS,LIPS,RIPS,LFLE,RFLE,LFME,RFME,LFAL,RFAL,LTAM,RTAM,LFCC,RFCC,LFM5,RFM5,LFM2,"
            "RFM2,LTT,RTT,SJN,SXS,CV7,LAC,RAC"
        ),
        {"LFAL": "ankle_lateral_l", "RFCC": "heel_r", "SXS": "xiphoid", "RTT": "tibial_tuberosity_r"},
    ),
    "Oxford Foot Model": (
        labels(
            "LASI,RASI,SACR,LTHI,RTHI,LKNE,RKNE,LHFB,RHFB,LTUB,RTUB,LSHN,RSHN,LTIB,RTIB,LANK,RANK,LHEE,RHEE,"
            "LCPG,RCPG,LLCA,RLCA,LSTL,RSTL,LP1M,RP1M,LD1M,RD1M,LP5M,RP5M,LD5M,RD5M,LTOE,RTOE,LHLX,RHLX"
        ),
        {
            "LP1M": "mt1_base_l",
            "RD5M": "mt5_head_r",
            "LHLX": "hallux_l",
            "RSTL": "heel_medial_r",
            "LTIB": "shank_wand_l",
        },
    ),
    "French laboratories": (
        labels(
            "EASD,EASG,EPSD,EPSG,CLD,CLG,CMD,CMG,TFIBD,TFIBG,MLD,MLG,MMD,MMG,CALD,CALG,MT1D,MT1G,MT5D,MT5G,"
            "ACD,ACG,ELD,ELG,EMD,EMG,PSRD,PSRG,PSUD,PSUG,FHAD,FHAG,THAD,THAG,XYP,MAN,C7,MTTETE"
        ),
        {
            "EASD": "asis_r",
            "EPSG": "psis_l",
            "MT5D": "mt5_head_r",
            "THAD": "shank_front_upper_r",
            "PSUG": "wrist_ulnar_l",
            "XYP": "xiphoid",
        },
    ),
    "CMU": (
        labels(
            "RFHD,LFHD,C7,T10,CLAV,STRN,RBAC,LSHO,RSHO,LELB,RELB,LFWT,RFWT,LBWT,RBWT,LTHI,RTHI,"
            "LKNE,RKNE,LSHN,RSHN,LANK,RANK,LHEE,RHEE,LTOE,RTOE,LMT5,RMT5"
        ),
        {"LFWT": "asis_l", "RBWT": "psis_r", "LSHN": "shank_wand_l", "RBAC": "back_offset"},
    ),
    "OpenCap / Stanford": (
        labels(
            "C7,r.ASIS,L.ASIS,r.PSIS,L.PSIS,r_knee,L_knee,r_mknee,L_mknee,r_ankle,L_ankle,r_calc,"
            "L_calc,r_toe,L_toe,r_5meta,L_5meta,r_thigh1,L_thigh1,r_sh2,L_sh2,R_elbow_lat,"
            "L_elbow_lat"
        ),
        {"r_calc": "heel_r", "L_mknee": "knee_medial_l", "r_5meta": "mt5_head_r", "L_sh2": "shank_cluster_l"},
    ),
    "Davis, as BTS and SIAMOC name it": (
        labels(
            "c7,sacrum,r should,l should,r asis,l asis,r thigh,l thigh,r bar 1,l bar 1,r knee 1,"
            "l knee 1,r knee 2,l knee 2,r bar 2,l bar 2,r mall,l mall,r met,l met,r heel,l heel"
        ),
        {
            "r knee 2": "fibula_head_r",
            "l bar 1": "thigh_wand_l",
            "r thigh": "trochanter_r",
            "l mall": "ankle_lateral_l",
        },
    ),
}


@pytest.mark.parametrize("family", BY_FAMILY)
def test_families_are_told_apart_by_all_labels_together(family):
    recorded, expected = BY_FAMILY[family]
    found = understand(recorded)
    assert found.family == family
    rows = found.by_label()
    assert {label: rows[label].landmark for label in expected} == expected
    assert all(rows[label].confidence > 0.5 for label in expected)


def test_keypoints_that_others_were_computed_from_and_those_of_a_head_are_no_markers():
    legs = labels("RHip LHip RKnee LKnee RAnkle LAnkle LBigToe RBigToe RShoulder LShoulder Neck Nose midHip")
    computed = labels("r.ASIS L.ASIS r_knee L_knee r_mknee L_mknee r_toe L_toe r_calc L_calc C7 RHJC LHJC")
    rows = understand([*legs, *(f"{label}_study" for label in computed)]).by_label()
    assert all(rows[label].computed for label in legs)
    expected = {"r_knee": "knee_lateral_r", "L_calc": "heel_l", "C7": "c7", "RHJC": "hip_centre_r"}
    assert {label: rows[f"{label}_study"].landmark for label in expected} == expected
    rows = understand(legs).by_label()
    assert [label for label in legs if rows[label].computed] == ["Neck", "Nose", "midHip"]
    assert rows["RKnee"].landmark == "knee_centre_r"


def test_the_same_label_means_what_its_family_means():
    sprint = labels(
        "RSH LSH RTHAP LTHAP RTHLD LTHLD RLEPI LLEPI RTIAP LTIAP RLMAL LLMAL RMFS LMFS RP5MT LP5MT RTOE LTOE"
    )
    assert understand(sprint).by_label()["RTOE"].landmark == "hallux_r"
    assert understand(PLUG_IN_GAIT).by_label()["RTOE"].landmark == "mt2_head_r"


def test_every_name_of_the_default_bodys_markers_is_understood_there_or_as_tracking_on_its_body():
    body = default_skeleton()
    rows = understand(PLUG_IN_GAIT).by_label()
    at = {m.name: m for m in body.markers}
    for label, row in rows.items():
        place = landmark_marker(atlas()[row.landmark], label, body)
        assert place.body == at[label].body
        np.testing.assert_array_equal(place.position_body, at[label].position_body)


def test_meaningless_labels_are_unknown():
    rows = understand(["M001", "M002", "M003", "M004", "M005"]).labels
    assert not any(row.used for row in rows)
    unnamed = Markers(("*1", "M001"), np.zeros((3, 2, 3)), 100.0)
    assert not any(row.used for row in understand(unnamed.names, [unnamed]).labels)


def test_words_in_any_order():
    rows = understand(["KneeLateral_R", "lateral_knee_L", "Right Anterior Superior Iliac Spine"]).by_label()
    assert rows["KneeLateral_R"].landmark == "knee_lateral_r"
    assert rows["lateral_knee_L"].landmark == "knee_lateral_l"
    assert rows["Right Anterior Superior Iliac Spine"].landmark == "asis_r"


@pytest.mark.parametrize("stem", ["BackAsis", "Asis_rear", "PostIliac", "Iliac_spine_posterior", "BackPsis"])
def test_an_anterior_spine_at_the_back_is_a_posterior_one(stem):
    front, behind = ("L_Asis", "R_Asis"), (f"L_{stem}", f"R_{stem}")
    rows = understand([*front, *behind]).by_label()
    assert [rows[label].landmark for label in (*front, *behind)] == ["asis_l", "asis_r", "psis_l", "psis_r"]
    assert all(rows[label].used for label in behind)


@pytest.mark.parametrize(
    ("right", "left", "expected"),
    [
        ("EIASD EIPSD GENOU_D Cheville.D MalleoleInterneD", "EIASG EIPSG GENOU_G Cheville.G MalleoleInterneG",
         "asis psis knee_lateral ankle_lateral ankle_medial"),
        ("R.EIAS R.EIPS", "L.EIAS L.EIPS", "asis psis"),
        ("D_Épaule D_Coude D_EIAS", "G_Épaule G_Coude G_EIAS", "acromion elbow_lateral asis"),
        ("genou droit, poignet droit", "genou gauche, poignet gauche", "knee_lateral wrist_middle"),
        ("SIAS_rechts SIPS_rechts KnieInnenRechts Knöchel_rechts",
         "SIAS_links SIPS_links KnieInnenLinks Knöchel_links", "asis psis knee_medial ankle_lateral"),
        ("rodilla_d tobillo_d EIAS_d codo_d", "rodilla_i tobillo_i EIAS_i codo_i",
         "knee_lateral ankle_lateral asis elbow_lateral"),
        ("joelho_direito ombro_direito", "joelho_esquerdo ombro_esquerdo", "knee_lateral acromion"),
        ("GinocchioDX CavigliaDX SIAS_DX", "GinocchioSX CavigliaSX SIAS_SX",
         "knee_lateral ankle_lateral asis"),
        ("r_knie r_enkel r_elleboog", "l_knie l_enkel l_elleboog",
         "knee_lateral ankle_lateral elbow_lateral"),
    ],
)  # fmt: skip
def test_labels_of_other_languages(right, left, expected):
    labels_of = [text.split(", ") if "," in text else text.split() for text in (right, left)]
    rows = understand([label for side in labels_of for label in side]).by_label()
    for side, recorded in zip("rl", labels_of, strict=True):
        assert [rows[label].landmark for label in recorded] == [f"{n}_{side}" for n in expected.split()]


def moving(names, landmarks, *, height=1.72, frames=80, seed=0, off=None):
    """A recording of a person of other proportions whose markers sit off their places."""
    rng = np.random.default_rng(seed)
    body = default_skeleton(height_m=height)
    marks = [landmark_marker(atlas()[n], label, body) for label, n in zip(names, landmarks, strict=True)]
    moved = [
        replace(
            m, position_body=m.position_body + rng.normal(0, m.spread_m / 1.7, 3) + (off or {}).get(m.name, 0)
        )
        for m in marks
    ]
    time = np.linspace(0, 2 * np.pi, frames)[:, None]
    phase = rng.uniform(0, 2 * np.pi, len(body.dofs))
    size = np.array([0.0 if d.startswith("pelvis") else 0.3 for d in body.dofs])
    q = body.default_q + size * (1 + np.sin(time + phase)) * np.sign(
        np.array([c.range[0] + c.range[1] for c in body.free_coordinates])
    )
    x = marker_positions(body.with_markers(moved), q)
    return Markers(tuple(names), x + rng.normal(0, 0.002, x.shape), 100.0)


@pytest.fixture(scope="module")
def walk():
    rows = understand(PLUG_IN_GAIT).by_label()
    return moving(PLUG_IN_GAIT, [rows[label].landmark for label in PLUG_IN_GAIT], height=1.60)


def test_right_labels_stay_sure_when_the_trajectories_are_seen(walk):
    rows = understand(PLUG_IN_GAIT, [walk]).labels
    assert min(row.confidence for row in rows) > 0.5


@pytest.mark.parametrize(
    ("one", "other"), [("LKNE", "RKNE"), ("RTHI", "RTIB"), ("LASI", "RKNE"), ("LELB", "RHEE")]
)
def test_exchanged_labels_lose_their_confidence(walk, one, other):
    names = [{one: other, other: one}.get(n, n) for n in PLUG_IN_GAIT]
    rows = understand(names, [replace(walk, names=tuple(names))]).by_label()
    assert rows[one].confidence < 0.5
    assert rows[other].confidence < 0.5
    assert np.mean([r.confidence > 0.5 for r in rows.values()]) > 0.85


def test_an_exchange_on_one_side_of_the_pelvis_does_not_pass_unnoticed(walk):
    """Which of the four markers is to blame cannot be told: RPSI contradicts both of the exchanged ones."""
    names = [{"LASI": "LPSI", "LPSI": "LASI"}.get(n, n) for n in PLUG_IN_GAIT]
    rows = understand(names, [replace(walk, names=tuple(names))]).by_label()
    assert min(rows[n].confidence for n in ("LASI", "LPSI", "RASI", "RPSI")) < 0.1


def test_distances_decide_where_a_label_has_two_meanings():
    places = {
        "ASIS": "asis", "Hip": "{0}", "Knee": "knee_lateral", "Ankle": "ankle_lateral", "Heel": "heel",
        "Shoulder": "acromion",
    }  # fmt: skip
    marks = {f"{s}.{k}": f"{v}_{s.lower()}" for k, v in places.items() for s in "RL"} | {"V.Sacral": "sacrum"}
    for meaning in ("trochanter", "hip_centre"):
        recording = moving(list(marks), [name.format(meaning) for name in marks.values()], seed=3)
        rows = understand(list(marks), [recording]).by_label()
        assert rows["R.Hip"].landmark == f"{meaning}_r"
        assert rows["L.Hip"].landmark == f"{meaning}_l"


def test_of_two_labels_for_one_bony_place_the_surer_is_used(walk):
    names = (*walk.names, "RASI#2")
    x = np.concatenate([walk.positions_ground, walk.positions_ground[:, [walk.names.index("RASI")]]], axis=1)
    rows = understand(names, [replace(walk, names=names, positions_ground=x)]).by_label()
    assert rows["RASI"].used
    assert not rows["RASI#2"].used


@pytest.mark.parametrize("seed", range(6))
def test_both_sides_of_a_pelvic_frame_are_believed_or_doubted_together(seed):
    """Markers on a frame around the hips: spines further apart than any, a little unlike left and right."""
    rows = understand(PLUG_IN_GAIT).by_label()
    rng = np.random.default_rng(seed)
    marks = {label: atlas()[rows[label].landmark] for label in PLUG_IN_GAIT}
    wide = {"ASI": rng.uniform(0.02, 0.05), "PSI": rng.uniform(0.08, 0.12)}
    off = {s + n: np.array([0, 0, d if s == "R" else -d]) for n, d in wide.items() for s in "RL"}
    recording = moving(PLUG_IN_GAIT, [m.name for m in marks.values()], seed=seed, off=off)
    read = understand(PLUG_IN_GAIT, [recording]).by_label()
    for spine in wide:
        assert read[f"R{spine}"].used == read[f"L{spine}"].used
        assert abs(read[f"R{spine}"].confidence - read[f"L{spine}"].confidence) < 0.05


def test_the_second_of_two_markers_of_one_name_is_the_inner_one():
    outer = {
        "ASI": "asis",
        "PSI": "psis",
        "THI": "thigh_wand",
        "KNE": "knee_lateral",
        "ANK": "ankle_lateral",
        "HEE": "heel",
    }
    inner = {"KNE#2": "knee_medial", "ANK#2": "ankle_medial"}
    marks = {f"{s}{k}": f"{v}_{s.lower()}" for k, v in (outer | inner).items() for s in "RL"}
    rows = understand(list(marks), [moving(list(marks), list(marks.values()), seed=2)]).by_label()
    assert {label: rows[label].landmark for label in marks if rows[label].used} == marks


@pytest.mark.parametrize(
    ("labels", "expected"),
    [
        ("RTET LTET RCOU LCOU RACR LACR REAS LEAS REPS LEPS RCL LCL RML LML STER PX",
         "RCOU elbow_lateral_r STER manubrium"),
        ("LUUPA RUUPA LLEP RLEP LMEP RMEP LUL RUL LRAD RRAD USACR LSACR RSACR",
         "LLEP elbow_lateral_l LSACR pelvis_cluster"),
        ("RCUBL LCUBL RCUBM LCUBM RKNEEM LKNEEM RMALM LMALM RM5 LM5", "RCUBM elbow_medial_r LM5 mt5_head_l"),
        ("RLHE LLHE RMHE LMHE RHMH2 LHMH2 RMFH5 LMFH5 SEL HV",
         "RLHE elbow_lateral_r LMFH5 mt5_head_l SEL forehead"),
    ],
)  # fmt: skip
def test_abbreviations_of_laboratories(labels, expected):
    rows = understand(labels.split()).by_label()
    words = expected.split()
    for label, landmark in zip(words[::2], words[1::2], strict=True):
        assert rows[label].landmark == landmark


@pytest.mark.parametrize("stem", ["THI", "KNE", "TIB", "ANK", "TOE", "SHO"])
@pytest.mark.parametrize("off_m", [0.05, 0.09, 0.14])
def test_markers_put_elsewhere_alike_on_both_sides_are_used_on_both_or_on_neither(stem, off_m):
    rows = understand(PLUG_IN_GAIT).by_label()
    marks = [rows[label].landmark for label in PLUG_IN_GAIT]
    off = {side + stem: np.array([0.5, 0.5, sign * 0.7]) * off_m for side, sign in (("R", 1), ("L", -1))}
    recording = moving(PLUG_IN_GAIT, marks, seed=4, off=off)
    read = understand(PLUG_IN_GAIT, [recording]).by_label()
    assert read[f"R{stem}"].used == read[f"L{stem}"].used


def test_a_doubtful_name_does_not_change_the_persons_size(real_data):
    """Of an upper body: a finger that is taken for a toe would shrink the person by its distances."""
    markers = read_trc(real_data / "format_trc_mot/btk_Anto.trc").markers
    rows = understand(markers.names, [markers]).by_label()
    assert rows["R.D5M1"].landmark == "mt5_head_r"
    assert not rows["R.D5M1"].used
    assert all(rows[f"{s}.{n}"].used for s in "RL" for n in ("Acromion", "AngulusAcromio", "HeadHum"))
