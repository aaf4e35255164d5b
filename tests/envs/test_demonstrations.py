"""Demonstrations: what is wrong is refused before episodes are driven, and frames are kept as they are."""

import sys
from types import SimpleNamespace
from typing import Any

import gymnasium
import pytest

from fogsim.errors import InputError
from fogsim_envs.demonstrations import main, record_demonstrations


class Collector(gymnasium.Wrapper[Any, Any, Any, Any]):
    def __init__(self, env: gymnasium.Env[Any, Any], *, jpeg_encoding: bool = True) -> None:
        super().__init__(env)
        self.is_lossy = jpeg_encoding

    def create_dataset(self, **_: Any) -> "Collector":
        return self


_MINARI = SimpleNamespace(list_local_datasets=lambda: {"there/one-v1": {}}, DataCollector=Collector)


@pytest.fixture(autouse=True)
def minari(monkeypatch: pytest.MonkeyPatch) -> None:
    """An extra that may be missing here."""
    monkeypatch.setitem(sys.modules, "minari", _MINARI)


@pytest.mark.parametrize("data_set", ["rule", "a/rule", "a rule-v1", "/rule-v1", "../rule-v1", "rule-v1/", ""])
def test_an_id_that_minari_would_not_take(data_set: str) -> None:
    with pytest.raises(InputError, match="data_set: expected an id such as"):
        record_demonstrations("rule", "fogsim/FogAdvisoryFast-v2", 1, data_set)


def test_a_data_set_that_is_there() -> None:
    with pytest.raises(InputError, match="already exists"):
        record_demonstrations("rule", "fogsim/FogAdvisoryFast-v2", 1, "there/one-v1")


@pytest.mark.parametrize("env_id", ["fogsim/FogAdvisoryFst-v2", "fogsim/FogAdvisoryBatch-v2", "nowhere/Fog-v1"])
def test_an_environment_that_is_none(
    env_id: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["demonstrations", "--env", env_id, "--episodes", "1"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith("error: ")


def test_frames_are_kept_without_loss() -> None:
    assert not record_demonstrations("random", "Pendulum-v1", 1, "there/pendulum-v1").is_lossy
