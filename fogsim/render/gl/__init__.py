"""Drawing with OpenGL on pyrender's EGL platform: the only package that imports either, in the process that draws."""
