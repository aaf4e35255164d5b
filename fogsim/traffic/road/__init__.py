"""Roads, signs and demand as the files of SUMO and OpenDRIVE have them; no simulation runs."""
