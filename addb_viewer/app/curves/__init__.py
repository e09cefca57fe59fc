"""The tab of curves: any quantities, over time or by gait cycle."""
