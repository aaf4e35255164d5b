"""Files of results, written so that nothing finished is lost and nothing is half written under its final name."""
