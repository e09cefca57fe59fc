"""The environment variables that say where reviews are kept."""

STORE = "ADDB_VIEWER_STORE"  # URL of a database that several people share
ROOT = "ADDB_VIEWER_ROOT"  # the folder that all of its subjects lie below
