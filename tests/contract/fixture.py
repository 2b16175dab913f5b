"""What all cases share: the contract, the running service, and calls that are held against the contract."""
import pathlib
import subprocess
import unittest

from contract import Contract
from service import Service, environment, wait_for

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
TRACKED_WITHIN_S = 90
# Unlike the built-in default: a robot that is added must take what the configuration says.
CONFIGURED_GATE = 18


class World:
    program = None
    contract = None
    service = None
    called = {}  # operation id -> statuses


def set_up(program):
    World.program = program
    World.contract = Contract(ROOT / "service" / "openapi.json")
    settings = [f"tracker.filter.gate={CONFIGURED_GATE}"]
    World.service = Service(program, str(HERE / "room.json"), settings)


def run_program(*arguments):
    done = subprocess.run([World.program, *arguments], capture_output=True, text=True, timeout=60, env=environment())
    assert done.returncode == 0, f"skylight {' '.join(arguments)}: exit code {done.returncode}: {done.stderr}"
    return done.stdout


class Case(unittest.TestCase):
    longMessage = True

    @property
    def contract(self):
        return World.contract

    @property
    def service(self):
        return World.service

    def call(self, operation_id, expect, path=None, query=None, body=None, headers=None):
        """Calls an operation, holds the answer against the contract, and its status against `expect`."""
        operation = self.contract.operations[operation_id]
        target = operation.target(path or {}, query)
        answer = self.service.request(operation.method, target, body, headers)
        World.called.setdefault(operation_id, set()).add(answer.status)
        what = f"{target} {'' if body is None else str(body)[:200]}"
        self.contract.check(operation, answer, what)
        self.assertEqual(answer.status, expect, f"{operation_id} {what}: {answer}")
        return answer

    def get(self, operation_id, path=None, query=None):
        return self.call(operation_id, 200, path, query).json()

    def problem(self, operation_id, expect, *words, **request):
        """An error whose detail has all these words."""
        detail = self.call(operation_id, expect, **request).json()["detail"]
        for word in words:
            self.assertIn(str(word), detail, f"{operation_id} {request}")
        return detail

    def pose_of(self, robot, **query):
        """The answer of getPose once it has a pose."""
        answer = wait_for(lambda: self.get("getPose", {"id": robot}, query), lambda a: a["pose"] is not None,
                          TRACKED_WITHIN_S)
        self.assertIsNotNone(answer["pose"], f"getPose: {robot} {query} has no pose: {answer}")
        return answer
