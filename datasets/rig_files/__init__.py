"""Rigs as other programs write them: OpenCV YAML, MATLAB and NumPy 3 x 4 matrices, DLT coefficients, mrcal camera models."""
