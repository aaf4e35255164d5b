"""Signs in a picture by the symmetry of their outlines (Bilateral Chinese Transform)."""
