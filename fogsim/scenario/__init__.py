"""Scenario files: schema, loading, catalogue, and building the stages from a scenario."""
