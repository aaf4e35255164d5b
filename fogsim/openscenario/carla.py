"""Files of CARLA's ScenarioRunner, which have other axes and another sun than the format."""

import contextlib

from fogsim.openscenario.daylight import clear_sky_illuminance, through_clouds
from fogsim.openscenario.xml_tree import Node

_MIRRORED = {
    "WorldPosition": "yh",
    "RelativeWorldPosition": ("dy",),
    "RelativeObjectPosition": ("dy",),
    "Orientation": "h",
}


def to_standard(root: Node) -> None:
    """Give a file the format's axes [m, rad] and sun [lx] if its description begins with ``CARLA:``, as there.

    CARLA's y is to the right of x, and the intensity of its sun is the share of the sky without clouds.
    """
    headers = (node.attributes.get("description", "") for node in root.children if node.tag == "FileHeader")
    for node in root.walk() if any(text.startswith("CARLA:") for text in headers) else ():
        # What is no number is found where it is read.
        with contextlib.suppress(ValueError):
            for key in node.attributes.keys() & {*_MIRRORED.get(node.tag, ())}:
                node.attributes[key] = repr(-float(node.attributes[key]))
            if node.tag == "Sun" and 0.0 < float(node.attributes.get("intensity", "0")) <= 1.0:
                clear = clear_sky_illuminance(float(node.attributes.get("elevation", "")))
                share = float(node.attributes["intensity"])
                node.attributes["intensity"] = repr(through_clouds(clear, 8.0 * (1.0 - share)))
