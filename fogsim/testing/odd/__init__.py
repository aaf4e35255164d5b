"""Operational design domains (ASAM OpenODD): which part of one a campaign has measured, with ``fogsim[odd]``."""
