"""Recordings of a fit for other viewers: rerun timelines (.rrd) and MCAP logs."""
