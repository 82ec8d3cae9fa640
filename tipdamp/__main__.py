"""`python -m tipdamp`: the same as the command `tipdamp`."""

import sys

from tipdamp.cli import main

sys.exit(main())
