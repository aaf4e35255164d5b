"""The examples can be read and explain themselves, also where what they learn with is not installed."""

import runpy
import sys
from pathlib import Path
from unittest.mock import MagicMock

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
OF_THE_EXTRAS = (
    "onnx",
    "stable_baselines3",
    "stable_baselines3.common",
    "stable_baselines3.common.base_class",
    "stable_baselines3.common.callbacks",
    "stable_baselines3.common.vec_env",
    "torch",
    "torch.distributions",
)


@pytest.mark.parametrize("script", sorted(EXAMPLES.glob("*.py")), ids=lambda script: script.stem)
def test_its_help_tells_what_it_is_for_and_how_long_it_takes(
    script: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for module in OF_THE_EXTRAS:
        monkeypatch.setitem(sys.modules, module, MagicMock())
    monkeypatch.setattr(sys, "argv", [script.name, "--help"])
    with pytest.raises(SystemExit, match="0"):
        runpy.run_path(str(script), run_name="__main__")
    told = capsys.readouterr().out
    assert "pip install 'fogsim[rl" in told
    assert f"python examples/{script.name} --minutes" in told
    assert "--seed" in told
