"""What rides in the ego: the view of its camera, its sensors, estimators and decisions."""
