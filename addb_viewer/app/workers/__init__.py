"""What the app runs in processes of its own, each by `python -m`: fit, solve, diagnose, record, what if."""
