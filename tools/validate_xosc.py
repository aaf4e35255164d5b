"""Check a .xosc file against ASAM's schemas, which scenariogeneration brings (pip install lxml scenariogeneration).

python tools/validate_xosc.py runs/demo/scenario.xosc
"""

import importlib.util
import sys
from pathlib import Path


def schemas() -> list[Path]:
    """ASAM's schemas of OpenSCENARIO, by version."""
    found = importlib.util.find_spec("scenariogeneration")
    if found is None or found.origin is None:
        sys.exit("needs the package scenariogeneration: pip install lxml scenariogeneration")
    return sorted((Path(found.origin).parent.parent / "schemas").glob("OpenSCENARIO_1_*.xsd"))


def main() -> None:
    """Validate the file that the command line names."""
    from lxml import etree  # noqa: PLC0415 - no dependency of FogSim

    document = etree.parse(sys.argv[1])
    for path in schemas():
        schema = etree.XMLSchema(etree.parse(str(path)))
        print(f"{path.stem}: {'valid' if schema.validate(document) else schema.error_log.last_error}")  # noqa: T201 - a tool's answer


if __name__ == "__main__":
    main()
