"""OpenGL by EGL (made with pyrender) or OSMesa: the only package that imports either, in the process that draws."""
