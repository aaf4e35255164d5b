"""What is known of a drive besides its images: signs and positions, and own lamps by night."""
