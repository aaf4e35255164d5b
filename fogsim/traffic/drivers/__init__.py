"""Drivers in plain values, whatever simulates them: sight, choice of speed, scripted manoeuvres."""
