"""Recordings of a fit for other viewers: rerun timelines (.rrd) and MCAP logs, and the log of a session."""
