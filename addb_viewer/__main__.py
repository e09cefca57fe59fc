"""`python -m addb_viewer` is the command line."""

import sys


def main() -> None:
    """Run the command line; Ctrl-C is no traceback, not even while the libraries are being loaded."""
    try:
        from addb_viewer.commands.cli import main as run  # noqa: PLC0415 (takes seconds, within reach of Ctrl-C)

        run()
    except KeyboardInterrupt:
        sys.stderr.write("addb-viewer: stopped; nothing was written\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
