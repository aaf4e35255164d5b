"""Pure physics of light in fog: extinction, optical depth, airlight."""
