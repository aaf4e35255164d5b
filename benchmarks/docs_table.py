"""Where benchmarks write what they have measured: between two marks of a page of the docs."""

from collections.abc import Iterable
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"


def write_table(page: str, name: str, lines: Iterable[str]) -> None:
    """Write lines between ``<!-- table: NAME -->`` and ``<!-- end of NAME -->``, which the page must have once.

    Parameters
    ----------
    page : str
        File of the docs.
    name : str
        Of the table.
    lines : iterable of str
        What stands there from now on.
    """
    path, mark, end = DOCS / page, f"<!-- table: {name} -->", f"<!-- end of {name} -->"
    before, rest = path.read_text(encoding="utf-8").split(mark)
    _, after = rest.split(end)
    path.write_text(f"{before}{mark}\n\n" + "\n".join(lines) + f"\n\n{end}{after}", encoding="utf-8")
