"""Light of lamps in fog: phase functions, beams, the veil of own lamps, halos."""
