"""`python -m foc_ros COMMAND`."""

import sys

from .cli.main import main

sys.exit(main())
