"""`python -m addb_viewer` is the command line."""

from addb_viewer.cli import main

if __name__ == "__main__":
    main()
