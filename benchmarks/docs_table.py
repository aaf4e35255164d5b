"""The writer of the docs' tables, docs/page_tables.py, for benchmarks."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs"))

from page_tables import lines_of, write_table

__all__ = ["lines_of", "write_table"]
