import sys
from pathlib import Path

import pytest

from fogsim import catalogue

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.nightly
def test_the_gallery_shows_every_scenario_as_it_is(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    import make_gallery

    assert {one.name for one in make_gallery.PICTURES.iterdir()} == {
        make_gallery.picture_of(name).name for name in catalogue()
    }
    assert make_gallery.PAGE.read_text(encoding="utf-8") == make_gallery.page(), "python docs/make_gallery.py --table"
    del sys.modules["make_gallery"]
