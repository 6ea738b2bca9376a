"""Files of parameters that hold a calibration of their own: read as tables of coefficients."""
