"""The service as a whole. Several clients at once: each gets answers that keep to the contract."""
import threading

from fixture import Case
from service import wait_for

ROUNDS = 15
READS = (("getPose", {"id": "anna"}, {}), ("listPoses", {}, {}), ("listRobots", {}, {}),
         ("getTrajectory", {"id": "ben"}, {"format": "csv"}), ("getCamera", {"id": "ceiling"}, {}),
         ("getSnapshot", {"id": "ceiling"}, {"width": 160}))


class Health(Case):
    def test_the_process_answers_and_frames_are_tracked(self):
        self.assertEqual(self.get("getLive"), {"status": "live"})
        self.assertLess(self.get("getReady")["age"], 2.1)


class Together(Case):
    def test_readers_and_writers_at_once_do_not_disturb_each_other(self):
        wrong = []

        def guarded(work):
            def run():
                try:
                    work()
                except Exception as error:  # told below, by the main thread
                    wrong.append(f"{type(error).__name__}: {error}")
            return threading.Thread(target=run)

        def read():
            for _ in range(ROUNDS):
                for operation, path, query in READS:
                    self.unless_busy(operation, 200, path, query)

        def write(name):
            def run():
                for _ in range(ROUNDS):
                    self.unless_busy("addRobot", 201, body={"id": name, "appearance": "anna"})
                    self.unless_busy("postOdometry", 202, {"id": name}, body={"v_mps": 0, "w_radps": 0})
                    self.unless_busy("changeRobot", 200, {"id": name}, body={"filter": {"gate": 12}})
                    self.unless_busy("removeRobot", 204, {"id": name})
            return run

        threads = [guarded(read) for _ in range(4)] + [guarded(write("one")), guarded(write("two"))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])
        self.assertEqual([robot["id"] for robot in self.get("listRobots")["items"]], ["anna", "ben"])

    def unless_busy(self, operation_id, expect, path=None, query=None, body=None):
        """As call(), but a 503 that says "try again" is tried again."""
        operation = self.contract.operations[operation_id]
        target = operation.target(path or {}, query)
        answer = wait_for(lambda: self.service.request(operation.method, target, body), lambda a: a.status != 503, 60)
        self.contract.check(operation, answer, target)
        self.assertEqual(answer.status, expect, f"{operation}: {answer}")
