"""zhu2015 as published over the two constants that the paper leaves open: G_max and ρ."""

from collections.abc import Mapping, Sequence

import numpy as np

from fogsim.estimators.zhu2015 import zhu_category
from fogsim.render import Renderer
from fogsim.reproduce.result import Cell, Rows, Steps, TitledTable
from fogsim.reproduce.road_sweeps import SETTINGS, Form, driven, last_estimate

GROWTHS = (0.5, 1.0, 1.5, 2.0, 3.0, 6.0, 10.0, 20.0)
"""G_max [grey levels]."""

SHARES = (0.3, 0.8)
"""ρ [-]."""

VISIBILITIES = (40.0, 80.0, 140.0, 250.0, 400.0, 800.0, 1500.0, 3000.0)
"""Two of each class [m]."""

VARIANTS: Mapping[str, Form] = {
    "published": {"as_published": True},
    "published + linear, no fog edges": {"repairs": ["linear_luminance", "fog_draws_no_edges"]},
}
"""Growth to the letter, and on linear luminance without the edges that fog draws."""


def swept_growth(renderer: Renderer, steps: Steps, drives: int) -> tuple[list[Mapping[str, Cell]], TitledTable]:
    """Share of drives in the right class for each G_max and ρ.

    Parameters
    ----------
    renderer : Renderer
        Of the road.
    steps : Steps
        Told of every drive.
    drives : int
        How many drives.

    Returns
    -------
    (list of records, TitledTable)
        A record for each variant, G_max, ρ and class.
    """
    setting = SETTINGS[0]
    seen = driven(renderer, setting, VISIBILITIES, drives, steps)
    records: list[Mapping[str, Cell]] = []
    for name, variant in VARIANTS.items():
        for share in SHARES:
            for growth in GROWTHS:
                form = {**variant, "growth": growth, "growth_share": share}
                classes = [
                    (zhu_category(one.visibility), last_estimate("zhu2015", setting.camera, form, one).diagnostics)
                    for one in seen
                ]
                for category in dict.fromkeys(true for true, _ in classes):
                    right = [told.get("class") is true for true, told in classes if true is category]
                    records.append(
                        {
                            "paper": "zhu2015",
                            "table": "growth",
                            "form": name,
                            "growth": growth,
                            "growth_share": share,
                            "category": category.value,
                            "right_share": float(np.mean(right)),
                        }
                    )
    title = "zhu2015 as published, over G_max [levels] and ρ: drives in the right class [%]"
    return records, TitledTable(title, _rows(records))


def _rows(records: Sequence[Mapping[str, Cell]]) -> Rows:
    categories = list(dict.fromkeys(str(one["category"]) for one in records))
    rows = [("form", "ρ", "G_max", *categories, "mean")]
    for form, share, growth in dict.fromkeys((one["form"], one["growth_share"], one["growth"]) for one in records):
        here = [
            float(one["right_share"] or 0.0)
            for one in records
            if (one["form"], one["growth_share"], one["growth"]) == (form, share, growth)
        ]
        cells = [f"{100.0 * one:.0f}" for one in (*here, float(np.mean(here)))]
        rows.append((str(form), f"{share:g}", f"{growth:g}", *cells))
    return tuple(rows)
