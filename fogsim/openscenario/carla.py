"""Files of CARLA's ScenarioRunner, which have other axes than the format."""

import contextlib

from fogsim.openscenario.xml_tree import Node

_MIRRORED = {
    "WorldPosition": "yh",
    "RelativeWorldPosition": ("dy",),
    "RelativeObjectPosition": ("dy",),
    "Orientation": "h",
}


def to_standard(root: Node) -> None:
    """Give a file the format's axes if its description begins with ``CARLA:``, whose y is to the right of x."""
    headers = (node.attributes.get("description", "") for node in root.children if node.tag == "FileHeader")
    for node in root.walk() if any(text.startswith("CARLA:") for text in headers) else ():
        # What is no number is found where it is read.
        with contextlib.suppress(ValueError):
            for key in node.attributes.keys() & {*_MIRRORED.get(node.tag, ())}:
                node.attributes[key] = repr(-float(node.attributes[key]))
