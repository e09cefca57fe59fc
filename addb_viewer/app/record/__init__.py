"""The Record tab: the fit as a file."""
