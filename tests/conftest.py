"""What holds for all tests: no example fails because the machine is slow, and Ctrl-C interrupts.

`make quick` takes the profile ``quick``, which tries fewer examples of each property. A shell
starts a job in the background with SIGINT ignored, and commands inherit that; what is tested is a
command that can be interrupted.

Tests run in one process for each processor, so matrices take one thread, as in the program.
"""

import os
import signal

from hypothesis import HealthCheck, settings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

settings.register_profile("ntagen", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("quick", settings.get_profile("ntagen"), max_examples=25)
settings.load_profile("ntagen")

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
