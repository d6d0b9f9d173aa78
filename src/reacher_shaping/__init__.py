"""Potential-based reward shaping for PPO on Reacher-v5, recomputed from the paper's text."""

__version__ = "0.1.0"
