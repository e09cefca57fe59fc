"""`croissant.json`: the release in the words of Croissant 1.0, which search engines and loaders read."""

from collections.abc import Mapping, Sequence
from typing import Any

from addb_viewer.dataset.schema import ROOT_TABLES, SUBJECT_TABLES
from addb_viewer.dataset.table import Column, Table
from addb_viewer.dataset.task import MadeFile
from addb_viewer.text.amounts import counted

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
CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileProperty": "cr:fileProperty",
    "fileObject": "cr:fileObject",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
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
