"""What holds for all tests: no example fails because the machine is slow.

`make quick` takes the profile ``quick``, which tries fewer examples of each property.
"""

from hypothesis import HealthCheck, settings

settings.register_profile("ntagen", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("quick", settings.get_profile("ntagen"), max_examples=25)
settings.load_profile("ntagen")
