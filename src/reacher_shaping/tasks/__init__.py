"""Environments: what is simulated, observed, rewarded and drawn."""
