"""The command line and the review app."""
