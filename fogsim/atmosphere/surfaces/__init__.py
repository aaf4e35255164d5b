"""Light of lamps on surfaces: of streets, tunnels, and other vehicles."""
