"""Files of CARLA's ScenarioRunner, which have other axes than the format, and criteria among their triggers."""

import contextlib

from fogsim.openscenario.findings import Findings
from fogsim.openscenario.xml_tree import Node

_MIRRORED = {"y", "dy", "h"}  # Of positions and orientations
_CRITERION = "criteria_"


def to_standard(root: Node, findings: Findings) -> None:
    """Give a file the format's axes if its description begins with ``CARLA:``, whose y is to the right of x.

    Conditions whose names begin with `criteria_` judge a run of ScenarioRunner and trigger nothing; they are left out.
    """
    headers = (node.attributes.get("description", "") for node in root.children if node.tag == "FileHeader")
    nodes = list(root.walk()) if any(text.startswith("CARLA:") for text in headers) else []
    for node in (one for one in nodes if one.tag.endswith(("Position", "Orientation"))):
        # What is no number is found where it is read.
        with contextlib.suppress(ValueError):
            for key in node.attributes.keys() & _MIRRORED:
                node.attributes[key] = repr(-float(node.attributes[key]))
    for node in (one for one in nodes if one.tag == "StopTrigger"):
        for group in node.children:
            criteria = [one for one in group.children if one.attributes.get("name", "").startswith(_CRITERION)]
            for one in criteria:
                findings.remark(one, "a criterion of ScenarioRunner; FogSim's are expectations")
            group.children = [one for one in group.children if one not in criteria]
        node.children = [group for group in node.children if group.children]
