"""What methods must know about a camera, and the staged scenes and models of lamps that it is measured with."""
