"""A local page on which fog, light and camera of a moment of a drive are changed by hand (``fogsim explore``)."""
