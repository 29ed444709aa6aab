"""Nonlinear models: classification by the whole equation, conversion, simulation, tangent and equilibrium."""
