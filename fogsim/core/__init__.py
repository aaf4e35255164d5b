"""What every room stands on: files, registries, parameters, random numbers, compiled kernels and linear algebra."""
