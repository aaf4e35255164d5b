import pytest

from fogsim.core.registry import parameters
from fogsim.errors import InputError, UnknownNameError
from fogsim.estimators import ESTIMATORS, make
from fogsim.values import Camera

CAMERA = Camera(64, 48, 60.0, (31.5, 23.5), 1.4)


@pytest.mark.parametrize("name", sorted(ESTIMATORS))
def test_every_estimator_is_made_under_its_own_name(name):
    estimator = make(name, CAMERA)
    assert estimator.method == name
    estimator.reset()


def test_unknown_names_answer_with_the_known():
    with pytest.raises(UnknownNameError, match="did you mean 'negru2013'"):
        make("negru2031", CAMERA)


def test_unknown_parameters_answer_with_the_allowed():
    with pytest.raises(InputError, match=r"as_published, .*pitch_deviation"):
        make("negru2013", CAMERA, smoothing=3)


def test_parameters_have_defaults():
    assert parameters(ESTIMATORS["negru2013"])["as_published"] is False
