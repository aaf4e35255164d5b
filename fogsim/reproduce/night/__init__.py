"""Scenes by night, and gallen2014 run again on them."""
