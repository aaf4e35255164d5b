"""Write the table of glow about tail lamps that `night_glow` reads: ``python tools/make_tail_glows.py`` (a second)."""

from pathlib import Path

import numpy as np

from fogsim.calibration.tail_glows import tail_glow_table

TABLE = Path(__file__).parents[1] / "fogsim" / "estimators" / "night" / "data" / "tail_glows.npz"

if __name__ == "__main__":
    TABLE.parent.mkdir(exist_ok=True)
    np.savez_compressed(TABLE, allow_pickle=False, **tail_glow_table())
