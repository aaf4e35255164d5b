"""Results to files: parquet, video, report."""
