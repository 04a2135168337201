"""Read and write pair tables: CSV and Parquet rows, checked and named."""
