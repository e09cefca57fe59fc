"""A fit on disk: written as a whole or not at all, read back as it was."""
