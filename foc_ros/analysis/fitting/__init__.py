"""Fitting: recordings of an operator enter; the parameters that explain them best leave."""
