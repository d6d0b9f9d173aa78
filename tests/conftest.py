"""The tests compute as the study's jobs do: on one thread, with kernels that round alike on all processors."""

from hypothesis import HealthCheck, settings

from reacher_shaping import processor

processor.fix()
# How fast a machine draws examples and runs them tells nothing of the code.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")
