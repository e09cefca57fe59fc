"""The Record tab: the fit as a file, and the log of the session."""
