"""Lines of sight, and what stands in them."""

from fogsim.obstruction.obstructions import CLEAR_SIGHT, Obstructions, Tunnel, obstructions_of, tunnels_of

__all__ = ["CLEAR_SIGHT", "Obstructions", "Tunnel", "obstructions_of", "tunnels_of"]
