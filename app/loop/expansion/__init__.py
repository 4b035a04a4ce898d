"""Thermal expansion of characteristics: their coefficients, and the size of a reading at 20 °C beside the measured one."""
