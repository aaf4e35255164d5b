import pytest

from fogsim.core.registry import Registry
from fogsim.errors import UnknownNameError


def test_an_unknown_name_answers_with_the_known_ones_and_the_nearest() -> None:
    registry = Registry("estimator", {"negru2013": 1, "zhu2015": 2})
    with pytest.raises(UnknownNameError, match=r"did you mean 'negru2013'\? Known: negru2013, zhu2015"):
        registry["negru2014"]


def test_a_duplicate_is_refused() -> None:
    registry = Registry("estimator", {"negru2013": 1})
    with pytest.raises(ValueError, match="registered already"):
        registry.register("negru2013", 2)
    registry.register("other", 3)
    assert list(registry) == ["negru2013", "other"]
