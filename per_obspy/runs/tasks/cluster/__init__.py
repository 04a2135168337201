"""Tasks on the workers of a Dask cluster: client, executor, checks of workers."""
