"""`python -m benchmarks.hidden make|check|score|run|page`: a public benchmark of hidden effects."""

import argparse
from pathlib import Path


def main() -> None:
    """Parse and do; what a command does not need is not imported."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hidden", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make", help="write cases, their list, and the truth elsewhere")
    making.add_argument("--out", type=Path, required=True, help="what is handed out")
    making.add_argument("--truth", type=Path, required=True, help="what is kept, with the salts")
    making.add_argument("--cases", type=int, default=300)
    making.add_argument("--seed", type=int, required=True)
    checking = commands.add_parser("check", help="whether the truths are those that were published")
    checking.add_argument("--list", type=Path, required=True, help="the published cases.json")
    checking.add_argument("--truth", type=Path, required=True)
    scoring = commands.add_parser("score", help="hold answers to the truth; needs NumPy only")
    scoring.add_argument("--truth", type=Path, required=True)
    scoring.add_argument("--submission", type=Path, required=True, help="a file, or a folder of CASE.json")
    running = commands.add_parser("run", help="answer every case that has no answer yet, by each of our rows")
    running.add_argument("--out", type=Path, required=True)
    running.add_argument("--limit", type=float, default=300.0, help="CPU seconds of a diagnosis")
    paging = commands.add_parser("page", help="write the page: every row that `run` answered")
    paging.add_argument("--out", type=Path, required=True)
    paging.add_argument("--truth", type=Path, required=True)
    paging.add_argument("--page", type=Path, required=True)
    for command in (running, paging):
        command.add_argument("--results", type=Path, required=True, help="one submission a row")
    given = parser.parse_args()
    {"make": _make, "check": _check, "score": _score, "run": _run, "page": _page}[given.command](given)


def _make(given: argparse.Namespace) -> None:
    from benchmarks.hidden.cases import make  # noqa: PLC0415

    make(given.out.resolve(), given.truth.resolve(), given.cases, given.seed)
    print(f"{given.cases} cases in {given.out}, their truths and salts in {given.truth}")


def _check(given: argparse.Namespace) -> None:
    from benchmarks.hidden.format import SealError, check_seals  # noqa: PLC0415

    try:
        print(f"{check_seals(given.list, given.truth)} truths are those that were published")
    except SealError as error:
        raise SystemExit(str(error)) from None


def _score(given: argparse.Namespace) -> None:
    from benchmarks.hidden.format import SubmissionError, read_submission  # noqa: PLC0415
    from benchmarks.hidden.scorer import judge, read_truths, report  # noqa: PLC0415

    truths = read_truths(given.truth)
    try:
        answers = read_submission(given.submission, truths)
    except SubmissionError as error:
        raise SystemExit(str(error)) from None
    print(report([judge(truths[case], answer) for case, answer in answers.items()]))


def _run(given: argparse.Namespace) -> None:
    from benchmarks.hidden.rows import run_all  # noqa: PLC0415

    run_all(given.out.resolve(), given.results.resolve(), given.limit)


def _page(given: argparse.Namespace) -> None:
    from benchmarks.hidden.page import section  # noqa: PLC0415
    from benchmarks.markdown import write_section  # noqa: PLC0415

    write_section(given.page, "hidden", section(given.out, given.truth, given.results))


if __name__ == "__main__":
    main()
