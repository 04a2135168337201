"""Tasks on the workers of a Dask cluster: what runs there, who is there, and the executor."""
