"""`python -m benchmarks.hidden make|check|score`: a public benchmark of hidden effects."""

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
    given = parser.parse_args()
    {"make": _make, "check": _check, "score": _score}[given.command](given)


def _make(given: argparse.Namespace) -> None:
    from benchmarks.hidden.making import make  # noqa: PLC0415

    make(given.out.resolve(), given.truth.resolve(), given.cases, given.seed)
    print(f"{given.cases} cases in {given.out}, their truths and salts in {given.truth}")


def _check(given: argparse.Namespace) -> None:
    from benchmarks.hidden.sealing import SealError, check_seals  # noqa: PLC0415

    try:
        print(f"{check_seals(given.list, given.truth)} truths are those that were published")
    except SealError as error:
        raise SystemExit(str(error)) from None


def _score(given: argparse.Namespace) -> None:
    from benchmarks.hidden.scorer import judge, read_truths, report  # noqa: PLC0415
    from benchmarks.hidden.submission import SubmissionError, read_submission  # noqa: PLC0415

    truths = read_truths(given.truth)
    try:
        answers = read_submission(given.submission, truths)
    except SubmissionError as error:
        raise SystemExit(str(error)) from None
    print(report([judge(truths[case], answer) for case, answer in answers.items()]))


if __name__ == "__main__":
    main()
