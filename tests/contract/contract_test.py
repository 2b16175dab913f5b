"""Holds service/openapi.json against the running program, in both directions.

    contract_test.py PROGRAM [unittest arguments, such as Poses or -v]
"""
import sys
import unittest

import fixture
from cases_calibration import Calibration
from cases_description import Description
from cases_ended import Ended
from cases_events import Events, Floor
from cases_geometry import Geometry
from cases_live import Live
from cases_odometry import Odometry
from cases_poses import Poses
from cases_refusals import Refusals
from cases_robots import Appearances, Cameras, Robots
from cases_simulator import Simulator
from cases_together import Health, Together

CASES = (Description, Refusals, Poses, Events, Floor, Odometry, Geometry, Robots, Appearances, Cameras, Health, Together, Simulator,
         Live, Calibration, Ended)


def suite(names):
    load = unittest.defaultTestLoader
    chosen = [case for case in CASES if not names or case.__name__ in names]
    return unittest.TestSuite(load.loadTestsFromTestCase(case) for case in chosen)


def uncalled():
    """Operations that no case has seen succeed, or none has seen refuse."""
    lines = []
    for name in fixture.World.contract.operations:
        statuses = fixture.World.called.get(name, set())
        if not any(200 <= status < 300 for status in statuses):
            lines.append(f"{name}: was never answered with success")
        if not any(400 <= status < 500 for status in statuses):
            lines.append(f"{name}: was never refused")
    return lines


def main():
    if len(sys.argv) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    names = [name for name in sys.argv[2:] if not name.startswith("-")]
    fixture.set_up(sys.argv[1])
    code = None
    try:
        result = unittest.TextTestRunner(verbosity=2, stream=sys.stdout).run(suite(names))
    finally:
        code = fixture.World.service.stop()
    wrong = [] if names else uncalled()
    if code != 0:
        wrong.append(f"skylight serve ended with {code}; its log:\n{fixture.World.service.log()}")
    print("\n".join(wrong))
    return 0 if result.wasSuccessful() and not wrong else 1


if __name__ == "__main__":
    sys.exit(main())
