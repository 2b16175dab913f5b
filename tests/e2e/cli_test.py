"""The command line from outside: cli_test.py <path of skylight>.

Each bad invocation must end by itself with its exit code (2: usage, 1: failed), say in words what is wrong
and where, and never crash. The good ones must fit together: what `simulate` writes, `track` reads back.
"""
import os
import sys
import unittest

import cli
from cases_calibrate import Calibrate
from cases_refused import Configuration, Help, Scenarios, Track, Usage
from cases_together import Together

if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: cli_test.py <path of skylight> [unittest's own arguments]")
    cli.PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main(verbosity=1)  # of all that is imported here
