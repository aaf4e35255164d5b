"""Many estimates over time to one belief."""
