"""Work in processes of its own: how it begins, waits, is watched and ends; and the solves that it leaves."""
