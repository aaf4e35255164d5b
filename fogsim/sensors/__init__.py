"""What a vehicle measures beside its camera."""
