"""ODD files: what is read of them, and that nothing in them is run, fetched or read from elsewhere."""

import sys
from pathlib import Path

import pytest

from fogsim.errors import InputError, MissingDependencyError
from fogsim.testing.odd.odd_file import read_odd, shipped_odds
from fogsim.testing.odd.openodd_library import Coverage

DOMAIN = """
TAXONOMY:
  env: {visibility: float length, bank: boolean}
  speed: float velocity
ODD:
  fog: {INCLUDE_AND: {visibility: "< 0.5 km"}}
"""
BINDING = """
openodd: [domain.yaml]
probes:
  env.visibility: {signal: fog.visibility_at_camera, unit: m, buckets: [0, 100, 1000]}
  speed: {signal: ego.speed, unit: km/h, buckets: [0, 90, 130], cover_by: seconds, target: 2}
"""


def odd_of(folder: Path, binding: str = BINDING, domain: str = DOMAIN) -> str:
    (folder / "domain.yaml").write_text(domain)
    (folder / "own.odd.yaml").write_text(binding)
    return str(folder / "own.odd.yaml")


def read(folder: Path, binding: str = BINDING, domain: str = DOMAIN) -> Coverage:
    return Coverage(read_odd(odd_of(folder, binding, domain)))


def test_the_shipped_ones_are_read_by_name() -> None:
    assert shipped_odds() == ["fog"]
    odd = read_odd("fog")
    assert (odd.name, len(odd.probes)) == ("fog", 8)
    Coverage(odd)


def test_imports_of_the_folder_are_read_once_and_before_what_imports_them(tmp_path: Path) -> None:
    (tmp_path / "taxonomy.yaml").write_text(DOMAIN.partition("ODD:")[0] + "IMPORT: [domain.yaml]\n")
    odd = read_odd(odd_of(tmp_path, domain="IMPORT: [taxonomy.yaml]\nODD:" + DOMAIN.partition("ODD:")[2]))
    assert len(odd.documents) == 2
    assert "TAXONOMY" in odd.documents[0]
    assert not any("IMPORT" in one for one in odd.documents)
    Coverage(odd)


def test_a_key_is_of_all_that_a_coverage_depends_on(tmp_path: Path) -> None:
    odd = read_odd(odd_of(tmp_path))
    others = [
        read_odd(odd_of(tmp_path, *texts))
        for texts in (
            [BINDING.replace("target: 2", "target: 3")],
            [BINDING.replace("ego.speed", "limit")],
            [BINDING, DOMAIN.replace("0.5 km", "400 m")],
        )
    ]
    assert len({one.keyed("run") for one in (odd, *others)}) == 4
    assert read_odd(odd_of(tmp_path)).keyed("run") == odd.keyed("run") != odd.keyed("other")


def test_hostile_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "odd"
    folder.mkdir()
    (tmp_path / "outside.yaml").write_text(DOMAIN)
    (folder / "evil.py").write_text("raise SystemExit('ran')")
    monkeypatch.syspath_prepend(str(folder))
    signal = "signal: ego.speed"
    mistakes = {
        "own.odd.yaml:2: '../outside.yaml' is not in the folder": [BINDING.replace("domain.yaml", "../outside.yaml")],
        "own.odd.yaml:2: '/etc/passwd' is not in": [BINDING.replace("domain.yaml", "/etc/passwd")],
        "own.odd.yaml:2: openodd": [
            BINDING.replace("domain.yaml", "{git: 'https://example.com/a.git', rev: v1, path: a.yaml}")
        ],
        "domain.yaml:1: '../outside.yaml' is not in the folder": [BINDING, "IMPORT: [../outside.yaml]\n" + DOMAIN],
        "unknown key 'conversion'": [BINDING, DOMAIN + "conversion: {length: {m: {km: {scale: 1}}}}\n"],
        "probes.speed.probe": [BINDING.replace(signal, "probe: 'evil:run'")],
        "'evil:run' or|unknown signal 'evil:run'": [BINDING.replace("ego.speed", "'evil:run'")],
        "at most 100": [BINDING.replace("[0, 90, 130]", str(list(range(200))))],
    }
    for message, texts in mistakes.items():
        with pytest.raises(InputError, match=message):
            read(folder, *texts)
    # A link leads out of the folder too.
    (folder / "link.yaml").symlink_to(tmp_path / "outside.yaml")
    with pytest.raises(InputError, match="is not in the folder"):
        read(folder, BINDING.replace("domain.yaml", "link.yaml"))
    for name in ("evil:run", "evil", str(folder / "missing.odd.yaml"), "os:system"):
        with pytest.raises(InputError, match="no such"):
            read_odd(name)
    assert "evil" not in sys.modules


def test_mistakes_name_file_line_key_and_what_is_allowed(tmp_path: Path) -> None:
    mistakes = {
        r"own.odd.yaml:5: probes.speed.bukets: .*buckets": BINDING.replace("[0, 90", "[0, 90").replace(
            "km/h, buckets", "km/h, bukets"
        ),
        r"own.odd.yaml:5: probes.speed.signal: .*did you mean 'ego.speed'": BINDING.replace("ego.speed", "ego.sped"),
        r"probes.speed.unit: the unit 'm' does not fit": BINDING.replace("unit: km/h", "unit: m"),
        r"probes.speed.unit: unknown unit 'furlongs_h'": BINDING.replace("unit: km/h", "unit: furlongs_h"),
        r"probes.speed.unit: ego.speed has a unit; expected one such as 'km/h'": BINDING.replace("unit: km/h, ", ""),
        r"probes.speed.buckets: edges must ascend": BINDING.replace("[0, 90, 130]", "[0, 90, 90]"),
        r"probes.speed.signal: ego.lane is lane": BINDING.replace("ego.speed, unit: km/h", "ego.lane"),
        r"probes.speed.buckets: ego.collision is no number": BINDING.replace("ego.speed, unit: km/h", "ego.collision"),
        # What openodd-py finds.
        r"own.odd.yaml: .*env.visbility is neither a concept": BINDING.replace("env.visibility", "env.visbility"),
        r"own.odd.yaml: .*cannot convert 'km'": BINDING.replace(
            "fog.visibility_at_camera, unit: m", "ego.speed, unit: km/h"
        ),
    }
    for message, binding in mistakes.items():
        with pytest.raises(InputError, match=message):
            read(tmp_path, binding)


def test_without_the_library_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openodd", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'fogsim\[odd\]'"):
        read(tmp_path)
