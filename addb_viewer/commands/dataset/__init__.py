"""`addb-viewer dataset`: one module a command."""
