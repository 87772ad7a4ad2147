"""What holds for all tests: no example fails because the machine is slow."""

from hypothesis import HealthCheck, settings

settings.register_profile("ntagen", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("ntagen")
