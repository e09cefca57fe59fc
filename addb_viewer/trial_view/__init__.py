"""What every page and file shows of one trial."""
