"""`addb-viewer benchmark`: one module a command."""
