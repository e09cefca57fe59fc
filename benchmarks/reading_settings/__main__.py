"""What settings of reading decide: each halved and doubled, on recordings that are changed beforehand.

    python -m benchmarks.reading_settings --out DIR

The recordings of the bench are turned, miswired, paired with other forces, begun with zeros, spoilt and
stripped of their units (a module each, which says how), and read with one setting changed at a time. Answers
are kept as lines of a file in DIR: it picks up where it was stopped, then writes READING_SETTINGS.md.
"""

import argparse
from pathlib import Path

from benchmarks.reading_settings.axes import turned
from benchmarks.reading_settings.cleaning import thrown
from benchmarks.reading_settings.pairs import pairs
from benchmarks.reading_settings.people import couples
from benchmarks.reading_settings.signs import miswired
from benchmarks.reading_settings.units import unsaid
from benchmarks.reading_settings.zeros import beginnings
from benchmarks.varied import Answer, Questions, asked, rules, tables, usual_of, variations
from solver.capture.axes import AxesSettings
from solver.capture.body_lengths import BodyLengthSettings
from solver.capture.edge_zeros import EdgeZeroSettings
from solver.capture.length_units import LengthUnitSettings
from solver.capture.loads_under_feet import UnderFeetSettings
from solver.capture.marker_cleaning import MarkerCleaningSettings
from solver.capture.plate_sign_settings import PlateSignSettings

PAGE = Path(__file__).parents[1] / "READING_SETTINGS.md"
ANSWERS = "reading.jsonl"
QUESTIONS = {
    "length_units": Questions(LengthUnitSettings(), unsaid, left_out=("smallest_m", "largest_m")),
    "edge_zeros": Questions(EdgeZeroSettings(), beginnings, left_out=("loaded_N",)),
    "cleaning": Questions(
        MarkerCleaningSettings(), thrown, left_out=("farthest_m", "same_m", "return_share", "spike_m")
    ),
    "axes": Questions(AxesSettings(), turned, left_out=("screen_weight", "flat_share", "plate_weight")),
    "plate_signs": Questions(PlateSignSettings(), miswired),
    "under_feet": Questions(UnderFeetSettings(), pairs, left_out=("contradiction", "samples", "sparse_")),
    "body_lengths": Questions(BodyLengthSettings(), couples),
}  # by the table of a TOML file
ASKED = {
    "length_units": "which unit a file is in that does not say so",
    "edge_zeros": "how many rows at a plate's beginning were not measured: zeros before a load or a landing",
    "cleaning": "which frames of a marker are wrong, of markers thrown off for a frame or four, and others",
    "axes": "which axis points up, upright and lying, with and without plates and names",
    "under_feet": "whether markers and forces are of one recording, and of one moment",
    "body_lengths": "whether two recordings show one person (no marker was placed again), and what is wrong",
    "plate_signs": "of each plate whether it counts the other way round, and whether it was tared",
}
INTRODUCTION = """# What settings of reading decide: each halved and doubled

Made by `python -m benchmarks.reading_settings`: the trials of the bench, changed beforehand. A row has, at
half and at double, the share of answers that are wrong, and of those that are others than usual. What these
recordings cannot show was not asked.

| table | asked | answers | wrong with the usual settings |
|---|---|---:|---:|
{rows}

"""


def page(answers: list[Answer]) -> str:
    """READING_SETTINGS.md."""
    usual = usual_of(answers)
    kinds = {type(of.usual).__name__: table for table, of in QUESTIONS.items()}
    rows = [
        f"| `{table}` | {ASKED[table]} | {usual[kind].of} | {100 * usual[kind].wrong:.1f} % |"
        for kind, table in kinds.items()
    ]
    return "\n".join([INTRODUCTION.format(rows="\n".join(rows)) + rules(), "", *tables(answers, kinds)])


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.reading_settings", description=__doc__)
    arguments.add_argument("--out", type=Path, required=True, help="folder in which answers are kept")
    file = arguments.parse_args().out / ANSWERS
    for of in QUESTIONS.values():
        answers = asked(file, variations(of.usual, of.left_out), of.answer)
    PAGE.write_text(page(answers), encoding="utf-8")


if __name__ == "__main__":
    main()
