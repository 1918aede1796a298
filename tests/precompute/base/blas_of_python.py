"""Loads the BLAS into a Python in which NumPy has one, with kernels of another processor."""
import ctypes
import os
import sys

os.environ["OPENBLAS_CORETYPE"] = "Prescott"
import numpy

ones = numpy.ones((300, 300), dtype=numpy.float32)
assert (ones @ ones == 300).all()
del os.environ["OPENBLAS_CORETYPE"]

library = ctypes.CDLL(sys.argv[1])
library.kernels_fit_processor.restype = ctypes.c_bool
library.error_of_product.restype = ctypes.c_float
assert library.kernels_fit_processor()
assert library.error_of_product() == 0
assert (ones @ ones == 300).all()
assert "OPENBLAS_CORETYPE" not in os.environ
