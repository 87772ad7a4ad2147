"""`python -m ntagen`: the command line."""

import sys

from ntagen.cli import main

sys.exit(main())
