"""Live cameras: one whose frames are posted, and one that is not there, over the running service."""
import json
import pathlib
import tempfile
import time

from fixture import Case, World
from service import Service, wait_for

GONE = "/dev/v4l/by-path/nothing-of-that-name"


def camera(name, source):
    return {"id": name, "source": source,
            "overhead": {"height_m": 3, "metres_per_pixel": 0.005, "size_px": [640, 480]}}


class Live(Case):
    @classmethod
    def setUpClass(cls):
        config = {"source": {"type": "cameras"}, "server": {"port": 0},
                  "cameras": [camera("ceiling", {"type": "posted"}), camera("door", {"type": "v4l2", "device": GONE})]}
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "room.json"
            file.write_text(json.dumps(config), encoding="utf-8")
            cls.live = Service(World.program, config=str(file), ready=False)
        # A picture of that size: what the simulator's camera sees.
        cls.jpeg = World.service.request("GET", "/api/v1/cameras/ceiling/snapshot.jpg?overlay=false").body

    @classmethod
    def tearDownClass(cls):
        assert cls.live.stop() == 0, cls.live.log()

    @property
    def service(self):
        return self.live

    def post(self, expect, body=None, path="ceiling", kind="image/jpeg", **query):
        return self.call("postFrame", expect, {"id": path}, query, self.jpeg if body is None else body,
                         {"Content-Type": kind})

    def test_a_posted_frame_is_tracked_at_its_time_and_a_camera_that_is_gone_is_named(self):
        captured = time.time() - 0.2
        self.assertEqual(self.post(202, captured=f"{captured:.6f}").json()["camera"], "ceiling")
        shown = wait_for(lambda: self.get("getCamera", {"id": "ceiling"}), lambda c: c["captured"] is not None, 60)
        self.assertAlmostEqual(shown["captured"], captured, delta=2e-6)
        self.assertEqual(shown["source"]["state"], "running")
        self.assertLess(abs(shown["source"]["clock_offset_s"]), 5)
        door = wait_for(lambda: self.get("getCamera", {"id": "door"}), lambda c: c["source"]["reason"], 60)
        self.assertEqual(door["source"]["state"], "failed")
        self.assertIn(GONE + ": No such file", door["source"]["reason"])
        self.call("getSnapshot", 503, {"id": "door"})
        self.call("getSnapshot", 200, {"id": "ceiling"})
        time.sleep(2.1)  # prediction.horizon_s: what was posted is old
        self.problem("getReady", 503, "no frame for", f"camera door is failed: {GONE}")

    def test_what_is_no_frame_is_refused(self):
        self.post(404, path="attic")
        self.post(409, path="door")
        self.post(415, body=b"{}", kind="application/json")
        self.post(422, body=b"no picture")
        self.post(422, body=self.jpeg[:200])
        self.post(422, captured="5")
        self.post(413, body=b"x" * (1024 * 1024 + 1))
