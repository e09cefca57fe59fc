"""Texts of a release: for people, what it is, on what terms and what to cite; for programs, Croissant 1.0."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from addb_viewer.dataset.build_task import REASONS, MadeFile
from addb_viewer.dataset.columns import Column, Table
from addb_viewer.dataset.release_tables import ROOT_TABLES, SUBJECT_TABLES
from addb_viewer.text.amounts import counted, lasting

Rows = Sequence[Mapping[str, Any]]


def readme(name: str, version: str, totals: Mapping[str, Any]) -> str:
    """README.md, with the configurations that dataset hubs read at its head."""
    configs = "\n".join(
        f"  - config_name: {table.name}\n    data_files: {table.path.replace('{subject}', '*')}"
        + ("\n    default: true" if table.name == "frames" else "")
        for table in (*SUBJECT_TABLES, *ROOT_TABLES)
        if table.name != "left_out"
    )
    lines = [
        "---",
        "configs:",
        configs,
        "---",
        "",
        f"# {name} {version}",
        "",
        f"{counted(totals['subjects'], 'subject')} ({counted(totals['persons'], 'person')}), "
        f"{counted(totals['trials'], 'trial')}, {counted(totals['frames'], 'frame')}, "
        f"{lasting(totals['hours'])}, {lasting(totals['hours_counting'])} of them with every foot's force "
        "measured and right.",
        "",
        "SI units, radians; ground frame, y up; forces act on the person. `frames` has motion, torques, "
        "forces and residuals, a row a frame; use rows with `counts`. `schema.json` describes every column, "
        "`manifest.json` how the files were made, `left_out.parquet` what is not here and why, DATASHEET.md "
        "what the data are good for, LICENCES.md on what terms.",
        "",
        "```python",
        "import polars as pl",
        "",
        'frames = pl.scan_parquet("frames/*.parquet").filter(pl.col("counts"))',
        'knee = frames.select("trial_id", "time_s", "q_knee_angle_r", "tau_knee_angle_r").collect()',
        "```",
        "",
    ]
    return "\n".join(lines)


def licences(subjects: Rows) -> str:
    """LICENCES.md: each source's licence, consent, and where it comes from."""
    kinds = sorted({(r["source"], r["licence"], r["consent"], r["url"] or "") for r in subjects})
    rows = [f"| {' | '.join(_cell(str(word)) for word in kind)} |" for kind in kinds]
    return "\n".join(
        ["# Licences", "", "| source | licence | consent | from |", "|---|---|---|---|", *rows, ""]
    )


def _cell(text: str) -> str:
    """A subject's own words in a table: neither a cell more, nor a link, nor HTML."""
    return re.sub(r"([\\|<>`*\[\]])", r"\\\1", " ".join(text.split()))


def citations(subjects: Rows) -> str:
    """CITATION.bib: what the sources ask to cite; texts that are no BibTeX as notes."""
    entries = []
    told = sorted({(r["source"], r["citation"]) for r in subjects if r["citation"]})
    for number, (source, text) in enumerate(told, start=1):
        if text.lstrip().startswith("@"):
            entries.append(text.strip())
        else:
            key = re.sub(r"\W+", "", source) or "source"
            title, note = (re.sub(r"[{}]", "", each) for each in (source, text))
            entries.append(f"@misc{{{key}{number},\n  title = {{{title}}},\n  note = {{{note}}}\n}}")
    return "\n\n".join(dict.fromkeys(entries)) + ("\n" if entries else "")


def datasheet(
    name: str,
    subjects: Rows,
    trials: Rows,
    left_out: Rows,
    totals: Mapping[str, Any],
    *,
    rate_hz: float | None,
) -> str:
    """DATASHEET.md: the questions of Gebru et al. 2021; every number from the tables."""
    sexes = {word: sum(row["sex"] == word for row in subjects) for word in ("female", "male")}
    ages = sorted(row["age_years"] for row in subjects if row["age_years"] is not None)
    reviewed = sum(row["reviewed"] for row in trials)
    reasons: dict[tuple[str, str], int] = {}
    for row in left_out:
        place = row["level"], row["reason"]
        reasons[place] = reasons.get(place, 0) + 1
    gone = [
        f"- {count} × {level}: {REASONS[level][reason]} (`{reason}`)"
        for (level, reason), count in sorted(reasons.items())
    ]
    grid = "each recording's own rate" if rate_hz is None else f"{rate_hz:g} Hz"
    sections = {
        "Motivation": [
            "Motion, forces and torques of people, in one form, to learn and test human dynamics."
        ],
        "Composition": [
            f"{counted(totals['subjects'], 'subject')} of {counted(totals['persons'], 'person')} from "
            f"{counted(totals['sources'], 'source')}; {counted(totals['trials'], 'trial')} in "
            f"{counted(totals['segments'], 'segment')}; {counted(totals['frames'], 'frame')} "
            f"({lasting(totals['hours'])}), of these {lasting(totals['hours_counting'])} count.",
            f"Sex: {sexes['female']} female, {sexes['male']} male, "
            f"{len(subjects) - sum(sexes.values())} not entered. Age: "
            + (f"{ages[0]:g} to {ages[-1]:g} years" if ages else "not entered")
            + f" ({len(ages)} entered).",
            "Left out:" if gone else "Nothing was left out.",
            *gone,
        ],
        "Collection": ["By the sources in LICENCES.md: optical motion capture and force plates."],
        "Review": [
            f"{reviewed} of {len(trials)} trials were reviewed by a person. Which forces count is decided by "
            "a person first, then by a review that came with the recording, then by detection; `detected_ok` "
            "is what detection says by itself."
        ],
        "Processing": [
            "Each trial was fitted whole, at its own rate, to markers and forces. Forces and the low-passed "
            "pass went through a Butterworth filter of order 3, forwards and backwards, at min(30 Hz, 0.8 of "
            f"the Nyquist frequency). Frames are those of {grid}, from splines; torques and residuals were "
            "computed there. Segments of at most 2000 frames were cut last, so that motion at their borders "
            "knows both sides; the dataset paper cut before the fit.",
        ],
        "Uses": ["Learning and testing predictors of forces and torques. No diagnosis of a person."],
        "Limits": [
            "No muscles: joint torques only. Activities are biased towards walking and running. Mass and "
            "inertias were fitted to the plates. Where a foot's force does not count, torques rest on a "
            "wrench that the motion demands (`torque_predicted`).",
        ],
        "Contact": [
            "The sources in LICENCES.md for the recordings; who passed this release on for the rest."
        ],
    }
    text = [f"# Datasheet of {name}"]
    for heading, paragraphs in sections.items():
        text += ["", f"## {heading}", "", *paragraphs]
    return "\n".join(text) + "\n"


CONFORMS_TO = "http://mlcommons.org/croissant/1.0"
PARQUET = "application/x-parquet"
_TYPES = {
    "bool": "sc:Boolean",
    "text": "sc:Text",
    "texts": "sc:Text",
    "f32": "sc:Float",
    "f64": "sc:Float",
    "floats": "sc:Float",
}
_REFERENCES = {"subject_id": "subjects", "trial_id": "trials"}  # columns that are another table's key
_BIASES = "Biased towards walking and running; shares of sources and activities stand in trials.parquet."
_SENSITIVE = (
    "Movement of people, with sex, age in years (above 89: 90), mass and height where entered. No names, no "
    "dates, no pictures."
)
_USES = "Learning and testing of human dynamics from motion; no diagnosis of a person."
_WORDS = (
    *("citeAs", "column", "equivalentProperty", "extract", "field", "fileProperty", "fileObject"),
    *("fileSet", "format", "includes", "isLiveDataset", "jsonPath", "key", "md5", "parentField", "path"),
    *("recordSet", "references", "regex", "repeated", "replace", "samplingRate", "separator", "source"),
    *("subField", "transform"),
)
"""Of Croissant itself."""
CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "sc": "https://schema.org/",
    **{word: f"cr:{word}" for word in _WORDS},
}


def croissant_of(
    name: str,
    version: str,
    subjects: Sequence[Mapping[str, Any]],
    files: Mapping[str, MadeFile],
    published: str | None = None,
) -> dict[str, Any]:
    """The release, its files, and a record set a table.

    Args:
        name: of the release.
        version: of it.
        subjects: rows of the table.
        files: of the release, by path.
        published: the day, YYYY-MM-DD; None: it is not told.
    """
    sources = sorted({row["source"] for row in subjects})
    urls = sorted({row["url"] for row in subjects if row["url"]})
    plain: dict[str, Any] = {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": CONFORMS_TO,
        "name": name,
        "description": "Human movement with ground reaction forces: motion, torques, forces and residuals of "
        f"{counted(len(subjects), 'subject')} from {', '.join(sources)}.",
        "license": sorted({row["licence"] for row in subjects}),
        "url": urls[0] if urls else "https://github.com/addb-viewer/addb-viewer",
        "creator": [{"@type": "sc:Organization", "name": source} for source in sources],
        "version": version,
        "citeAs": "\n\n".join(sorted({row["citation"] for row in subjects if row["citation"]})) or name,
        "keywords": ["biomechanics", "human movement", "inverse dynamics", "ground reaction forces"],
        "isLiveDataset": False,
        "rai:dataCollection": "Optical motion capture and force plates; collected by the sources.",
        "rai:dataBiases": _BIASES,
        "rai:personalSensitiveInformation": _SENSITIVE,
        "rai:dataUseCases": _USES,
        "distribution": [*(_object(table, files) for table in ROOT_TABLES), *map(_set, SUBJECT_TABLES)],
        "recordSet": [_records(table) for table in (*ROOT_TABLES, *SUBJECT_TABLES)],
    }
    if published:
        plain["datePublished"] = published
    return plain


def _object(table: Table, files: Mapping[str, MadeFile]) -> dict[str, Any]:
    return {
        "@type": "cr:FileObject",
        "@id": table.path,
        "name": table.path,
        "contentUrl": table.path,
        "encodingFormat": PARQUET,
        "sha256": files[table.path].sha256,
        "contentSize": f"{files[table.path].bytes} B",
    }


def _set(table: Table) -> dict[str, Any]:
    return {
        "@type": "cr:FileSet",
        "@id": f"{table.name}-files",
        "name": f"{table.name}-files",
        "encodingFormat": PARQUET,
        "includes": f"{table.name}/*.parquet",
    }


def _records(table: Table) -> dict[str, Any]:
    return {
        "@type": "cr:RecordSet",
        "@id": table.name,
        "name": table.name,
        "description": table.description,
        "key": [{"@id": f"{table.name}/{name}"} for name in table.key],
        "field": [_field(table, column) for column in table.columns],
    }


def _field(table: Table, column: Column) -> dict[str, Any]:
    holds = (
        {"fileSet": {"@id": f"{table.name}-files"}}
        if table.of_subjects
        else {"fileObject": {"@id": table.path}}
    )
    unit = f" [{column.unit}]" if column.unit else ""
    plain: dict[str, Any] = {
        "@type": "cr:Field",
        "@id": f"{table.name}/{column.name}",
        "name": f"{table.name}/{column.name}",
        "description": f"{column.description}{unit}",
        "dataType": _TYPES.get(column.kind, "sc:Integer"),
        "source": {**holds, "extract": {"column": column.name}},
    }
    if column.kind in ("texts", "floats"):
        plain["repeated"] = True
    target = _REFERENCES.get(column.name)
    if target and target != table.name:
        plain["references"] = {"field": {"@id": f"{target}/{column.name}"}}
    return plain
