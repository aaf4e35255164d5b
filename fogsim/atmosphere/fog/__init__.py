"""Daylight through fog: extinction, optical depth, transmittance and airlight."""
