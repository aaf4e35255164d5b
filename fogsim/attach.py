"""Ride along in a simulation whose steps somebody else commands."""
