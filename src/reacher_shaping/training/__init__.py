"""Shaping, policies, rollouts and PPO for many seeds at once. Pure: no file, no log."""
