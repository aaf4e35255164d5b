"""Finding what each pixel sees without any graphics system."""
