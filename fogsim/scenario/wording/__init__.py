"""A scenario in words: its settings that are not defaults, and sentences for a methods section."""
