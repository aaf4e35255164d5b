"""One version: what is installed, what is cited, and what the changelog tells of."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml

from tests.helpers.command import run_python

CHECKOUT = Path(__file__).resolve().parents[2]
VERSION = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]


def test_changelog_citation_and_page_have_the_version_and_its_date() -> None:
    citation = yaml.safe_load((CHECKOUT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == VERSION
    # Citation File Format 1.2.0: these four are required.
    assert citation["cff-version"] == "1.2.0"
    assert all(citation[key] for key in ("message", "title", "authors"))
    headings = re.findall(r"^## (.+)$", (CHECKOUT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    released = next(heading for heading in headings if heading != "Unreleased")
    page = (CHECKOUT / "docs" / "benchmarks" / "reproducibility.md").read_text(encoding="utf-8")
    assert f"version = {{{VERSION}}}" in page
    assert released == f"{VERSION} – {citation['date-released']}"


def test_no_text_installs_what_no_index_has() -> None:
    """FogSim is installed from a checkout or a wheel; an extra by name is added to that installation."""
    texts = [*CHECKOUT.glob("*.md"), *CHECKOUT.glob("notebooks/*.ipynb"), *CHECKOUT.glob("docs/**/*.md")]
    for folder in ("fogsim", "envs", "examples", "scenarios"):
        texts += [one for one in (CHECKOUT / folder).rglob("*") if one.suffix in {".md", ".py", ".html"}]
    assert len(texts) > 500
    wrong = re.compile(r"pip install ['\"]?fogsim(?!\[)")
    assert [path for path in texts if wrong.search(path.read_text(encoding="utf-8"))] == []


@pytest.mark.nightly
def test_an_extra_is_added_to_the_installation_without_an_index() -> None:
    done = run_python("-m", "pip", "install", "--no-index", "--dry-run", "--disable-pip-version-check", "fogsim[test]")
    assert "Would install" not in done.stdout
