"""What a trained policy does: evaluation episodes, reference controllers, videos, the demo."""
