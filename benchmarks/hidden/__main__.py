"""`python -m benchmarks.hidden make`: a public benchmark of hidden effects."""

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
    given = parser.parse_args()
    if given.command == "make":
        _make(given)
    else:
        _check(given)


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


if __name__ == "__main__":
    main()
