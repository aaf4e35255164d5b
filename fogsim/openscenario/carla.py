"""Files of CARLA's ScenarioRunner, which have other axes than the format."""

import contextlib

from fogsim.openscenario.xml_tree import Node

_MIRRORED = {"y", "dy", "h"}  # Of positions and orientations


def to_standard(root: Node) -> None:
    """Give a file the format's axes if its description begins with ``CARLA:``, whose y is to the right of x."""
    headers = (node.attributes.get("description", "") for node in root.children if node.tag == "FileHeader")
    nodes = root.walk() if any(text.startswith("CARLA:") for text in headers) else ()
    for node in (one for one in nodes if one.tag.endswith(("Position", "Orientation"))):
        # What is no number is found where it is read.
        with contextlib.suppress(ValueError):
            for key in node.attributes.keys() & _MIRRORED:
                node.attributes[key] = repr(-float(node.attributes[key]))
