"""Expectations of a run: what must hold in it, and what came."""
