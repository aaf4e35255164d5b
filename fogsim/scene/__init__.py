"""Road, markings, signs, vehicles and roadside as plain geometry and materials."""
