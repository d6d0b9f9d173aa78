"""What the workflow's jobs do around the science: training, checkpoints, progress, searches, notebooks."""
