"""Visibilities as people read them."""

from fogsim.values import Estimate

ENDLESS = 10_000.0
"""Visibility from which on one speaks of clear air [m]."""


def metres(visibility: float) -> str:
    """Visibility [m] with its unit; "clear" from ten kilometres on."""
    return "clear" if visibility >= ENDLESS else f"{visibility:.0f} m"


def interval_text(estimate: Estimate) -> str:
    """Give the 90 % interval of a valid estimate's visibility."""
    low, high = estimate.visibility_interval
    if high >= ENDLESS:
        return f"> {low:.0f} m"
    return f"{low:.0f} – {high:.0f} m"
