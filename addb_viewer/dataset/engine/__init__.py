"""Who does the work of a release: processes of this machine, or a Dask cluster."""
