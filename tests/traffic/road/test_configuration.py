import gzip
from pathlib import Path

import pytest

from fogsim.errors import InputError
from fogsim.traffic.road.configuration import OVERRIDES, check_configured_files, configured_files, ignored_options
from fogsim.traffic.road.unsafe_outputs import check_outputs

NET = Path(__file__).parents[2] / "data" / "grid" / "grid.net.xml"


def config(folder: Path, content: str) -> Path:
    path = folder / "a.sumocfg"
    path.write_text(content, encoding="utf-8")
    return path


def test_files_are_relative_to_the_configuration(tmp_path: Path) -> None:
    path = config(
        tmp_path,
        '<configuration><input><net-file value="nets/a.net.xml"/><additional-files value="b.add.xml, /c.add.xml"/>'
        "</input></configuration>",
    )
    assert configured_files(path) == (tmp_path / "nets/a.net.xml", (tmp_path / "b.add.xml", Path("/c.add.xml")))
    short = config(tmp_path, '<configuration><n value="a.net.xml"/></configuration>')
    assert configured_files(short) == (tmp_path / "a.net.xml", ())
    for content, message in [("<configuration", "not XML"), ("<configuration/>", "names no network")]:
        with pytest.raises(InputError, match=message):
            configured_files(config(tmp_path, content))


def test_options_that_cannot_hold_here_are_told_with_the_reason(tmp_path: Path) -> None:
    path = config(
        tmp_path,
        '<configuration><traci_server><remote-port value="8813"/></traci_server><random v="true"/>'
        '<step-length value="1"/></configuration>',
    )
    step, port, random = ignored_options(path, 0.1)
    assert step == "step-length=1 is left out: clocks.traffic_step_s is 0.1"
    assert port.startswith("remote-port=8813 is left out: SUMO would listen")
    assert random == "random=true is left out: a run must depend on its seed alone"
    assert OVERRIDES[:4] == ("--remote-port", "0", "--random", "false")
    assert OVERRIDES[4:6] == ("--xml-validation", "never")  # a schema may lie at any address
    for text in ['<remote-port value="0"/>', '<random value="False"/>', "<random/>", '<step-length value="0.1"/>']:
        assert ignored_options(config(tmp_path, f"<configuration>{text}</configuration>"), 0.1) == ()


def test_options_that_reach_outside_the_runs_folder_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHOWN_ON", ":1")
    for option, value, message in [
        ("save-template", "/any/file", "save-template: SUMO would write that file outside"),
        ("C", "/any/file", "C: SUMO would write"),
        ("vtk-output", "a", "SUMO would write"),
        ("pedestrian.jupedsim.wkt", "a", "SUMO would write"),
        ("save-state.period.keep", "1", "SUMO would remove files outside"),
        ("output-suffix", "../../", "must hold no folder"),
        ("fcd-output", "10.0.0.1:8080", "fcd-output: .*not to a network address"),
        ("device.ssm.file", "a.example: 80", "not to a network address"),
        ("summary", "a.example${SHOWN_ON}", "not to a network address"),
        ("tripinfo", "[::1]:80", "not to a network address"),
    ]:
        for written in (
            f'<{option} value="{value}"/>',
            f'<{option} value="" v="{value}"/>',
            f"<{option}>{value}</{option}>",
        ):
            path = config(tmp_path, f'<configuration><n value="{NET}"/>{written}</configuration>')
            with pytest.raises(InputError, match=message):
                check_configured_files(path)


def test_values_that_only_look_like_addresses_are_accepted(tmp_path: Path) -> None:
    options = '<begin value="0:10:00"/><device.taxi.dispatch-algorithm.params value="loss:3"/><vtk-output value=""/>'
    check_configured_files(config(tmp_path, f'<configuration><n value="{NET}"/>{options}</configuration>'))


def test_outputs_of_additional_and_included_files_have_no_addresses(tmp_path: Path) -> None:
    for element in (
        '<edgeData id="e" file="10.0.0.1:80"/>',
        '<timedEvent type="SaveTLSStates" source="0" dest="10.0.0.1:80"/>',
        '<vType id="t"><param key="device.ssm.file" value="10.0.0.1:80"/></vType>',
    ):
        (tmp_path / "in.xml").write_text(f"<additional>{element}</additional>", encoding="utf-8")
        (tmp_path / "b c.xml").write_text('<additional><include href="in.xml"/></additional>', encoding="utf-8")
        files = '<additional-files value="${NOWHERE}b c.xml"/>'
        path = config(tmp_path, f'<configuration><n value="{NET}"/>{files}</configuration>')
        with pytest.raises(InputError, match=r"in\.xml:1: .*not to a network address, got '10\.0\.0\.1:80'"):
            check_configured_files(path)


def test_addresses_are_found_however_a_file_writes_them(tmp_path: Path) -> None:
    path, element = tmp_path / "a.add.xml", '<additional>{}<edgeData id="e" file="10.0.0.1{}80"/></additional>'
    far = element.format(f"<!-- {'x' * 2**22} -->", ":").encode()
    for written in (
        far,
        gzip.compress(far),
        element.format("", "&#58;").encode(),
        f'<?xml version="1.0" encoding="UTF-16"?>{element.format("", ":")}'.encode("utf-16"),
    ):
        path.write_bytes(written)
        with pytest.raises(InputError, match="not to a network address"):
            check_outputs([path])
    path.write_text(element.format("", "_"), encoding="utf-8")
    check_outputs([path])
