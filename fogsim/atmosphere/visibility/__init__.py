"""How far one sees: contrast thresholds of the eye, signals at night, glare."""
