"""What may be asked for: the schema of config.yaml. Neither numpy nor torch is loaded."""
