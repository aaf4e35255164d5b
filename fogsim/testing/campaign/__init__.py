"""Campaigns: cases drawn from a declared space, the boundary between pass and fail, and the failure rate."""
