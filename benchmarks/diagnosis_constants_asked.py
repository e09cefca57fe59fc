"""One question of `benchmarks.diagnosis_constants`, in a process of its own: prints probabilities by case."""

import json
import pickle
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.rewriting import Number, set_otherwise


def main() -> None:
    """Change the constant before anything of the solver is read, then answer."""
    out, asks = Path(sys.argv[1]), json.loads(sys.argv[2])
    if asks["number"] is not None:
        set_otherwise(Number(*asks["number"]), asks["factor"])
    print(json.dumps({case: _probabilities(out, case, asks) for case in asks["cases"]}))


def _probabilities(out: Path, case: str, asks: dict[str, Any]) -> dict[str, float]:
    from benchmarks.hidden.rows.ours import answer_of  # noqa: PLC0415 (reads the solver)
    from benchmarks.rewriting import scaled  # noqa: PLC0415
    from solver.capture.subject import open_subject  # noqa: PLC0415
    from solver.diagnosis.balance import Balance  # noqa: PLC0415
    from solver.diagnosis.diagnose import diagnosis_from, looked_at  # noqa: PLC0415
    from solver.diagnosis.report import as_json  # noqa: PLC0415
    from solver.progress import silent  # noqa: PLC0415
    from solver.settings import settings_for  # noqa: PLC0415

    folder, kept = out / "cases" / case, out / "kept" / f"{case}.pickle"
    settings = settings_for(folder)
    if asks["setting"] is not None:
        key = asks["setting"].split(".")[1]
        value = scaled(getattr(settings.diagnosis, key), asks["factor"])
        settings = replace(settings, diagnosis=replace(settings.diagnosis, **{key: value}))
    if kept.exists() and not asks["from_the_files"]:
        found = pickle.loads(kept.read_bytes())
        if asks["setting"] is not None:
            found = replace(found, balance=Balance(found.balance.trials, settings.diagnosis))
    else:
        subject = open_subject(folder, settings.reading)
        found = looked_at(subject, settings, trials=None, reviews={}, progress=silent)
        if asks["number"] is None and asks["setting"] is None:
            kept.parent.mkdir(exist_ok=True)
            kept.write_bytes(pickle.dumps(found))
    answer = answer_of(json.loads(json.dumps(as_json(diagnosis_from(found)), default=float)))
    return dict(answer["probabilities"])


if __name__ == "__main__":
    main()
