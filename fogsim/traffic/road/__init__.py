"""Roads, signs and demand from files of SUMO and OpenDRIVE, without a simulation."""
