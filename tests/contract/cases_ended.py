"""A source that has ended: nothing old passes for new, and what was recorded can still be read."""
import json
import pathlib
import tempfile

from fixture import HERE, Case, World
from service import Service, wait_for

DURATION_S = 4


class Ended(Case):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            scenario = json.loads((HERE / "room.json").read_text(encoding="utf-8"))
            file = pathlib.Path(folder) / "short.json"
            file.write_text(json.dumps({**scenario, "duration_s": DURATION_S}), encoding="utf-8")
            cls.ended = Service(World.program, str(file))
        wait_for(lambda: cls.ended.request("GET", "/readyz").json().get("detail", ""), lambda d: "ended" in d, 120)
        # Beyond the horizon (2 s) the newest frame is stale.
        wait_for(lambda: cls.ended.request("GET", "/api/v1/robots/ben/pose").json(), lambda a: a["state"] == "lost", 60)

    @classmethod
    def tearDownClass(cls):
        assert cls.ended.stop() == 0, cls.ended.log()

    @property
    def service(self):
        return self.ended

    def test_it_is_not_ready_and_says_why(self):
        self.problem("getReady", 503, "ended")

    def test_robots_are_lost_with_a_reason_everywhere(self):
        answer = self.get("getPose", {"id": "ben"})
        self.assertEqual((answer["state"], answer["pose"]), ("lost", None))
        self.assertIn("ended", answer["reason"])
        self.assertEqual(self.get("listPoses")["items"][1]["state"], "lost")
        self.assertEqual(self.get("getRobot", {"id": "ben"})["status"]["state"], "lost")

    def test_what_was_recorded_is_read_back_at_the_very_instants_it_names(self):
        points = self.get("getTrajectory", {"id": "ben"}, {"kind": "measured"})["points"]
        self.assertTrue(points)
        for point in (points[0], points[len(points) // 2], points[-1]):
            at = f"{point['captured']:.6f}"
            answer = self.get("getPose", {"id": "ben"}, {"kind": "measured", "at": at})
            self.assertIsNotNone(answer["pose"], f"getPose: nothing at {at}, where the trajectory has {point}: {answer}")
            self.assertAlmostEqual(answer["pose"]["x"], point["x"], delta=1e-6)
        bounds = {"kind": "measured", "from": f"{points[0]['captured']:.6f}", "to": f"{points[-1]['captured']:.6f}"}
        self.assertEqual(len(self.get("getTrajectory", {"id": "ben"}, bounds)["points"]), len(points))

    def test_the_last_picture_is_still_shown_with_its_own_time(self):
        answer = self.call("getSnapshot", 200, {"id": "ceiling"}, {"width": 64})
        captured = self.get("getCamera", {"id": "ceiling"})["captured"]
        self.assertAlmostEqual(float(answer.headers["skylight-captured"]), captured, delta=2e-6)
