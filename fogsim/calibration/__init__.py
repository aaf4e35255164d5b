"""What methods must know of a camera before they can tell anything, computed by the models of air and lamps."""
