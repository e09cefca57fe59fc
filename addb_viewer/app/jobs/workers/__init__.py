"""What runs in these processes, each by `python -m`."""
