"""The environment variables that are ours."""

STORE = "ADDB_VIEWER_STORE"  # URL of a database that several people share
ROOT = "ADDB_VIEWER_ROOT"  # the folder that all of its subjects lie below
ENDS_WITH_STDIN = "ADDB_VIEWER_ENDS_WITH_STDIN"  # set for processes that end with the one that started them
