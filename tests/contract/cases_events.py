"""What took place: numbered events, read from where one was; and the floor on which it did."""
import json

from fixture import HERE, Case, World
from service import Service


class Events(Case):
    def test_who_reads_on_from_next_gets_every_event_once(self):
        self.call("addRobot", 201, body={"id": "guest", "appearance": "anna"})
        self.call("removeRobot", 204, {"id": "guest"})
        since, seen = 0, []
        while True:
            page = self.get("listEvents", query={"since": since, "limit": 1})
            self.assertFalse(page["dropped"])
            if not page["items"]:
                break
            seen += page["items"]
            since = page["next"]
        self.assertEqual([event["sequence"] for event in seen], list(range(1, len(seen) + 1)))
        times = [event["time"] for event in seen]
        self.assertEqual(times, sorted(times))
        kinds = [event["kind"] for event in seen]
        self.assertIn("source.state", kinds)
        ours = [event["kind"] for event in seen if event["robot"] == "guest"]
        self.assertEqual(ours, ["robot.added", "robot.removed"])

    def test_they_are_picked_by_what_they_concern(self):
        start = self.get("listEvents")["next"]
        self.call("addRobot", 201, body={"id": "visitor", "appearance": "anna"})
        self.call("changeRobot", 200, {"id": "visitor"}, body={"surface_height_m": 0.3})
        self.call("changeRobot", 200, {"id": "visitor"}, body={"surface_height_m": 0.3})  # nothing changes
        self.call("removeRobot", 204, {"id": "visitor"})
        page = self.get("listEvents", query={"since": start, "robot": "visitor"})
        self.assertEqual([event["kind"] for event in page["items"]],
                         ["robot.added", "robot.changed", "robot.removed"])
        self.assertEqual(self.get("listEvents", query={"since": start, "kind": "robot.changed"})["items"],
                         page["items"][1:2])
        self.assertEqual(len(self.get("listEvents", query={"since": start, "kind": "robot"})["items"]), 3)
        self.assertEqual(self.get("listEvents", query={"since": start, "kind": "rob"})["items"], [])
        self.assertEqual(self.get("listEvents", query={"robot": "visitor", "severity": "warning"})["items"], [])
        self.assertEqual(self.get("listEvents", query={"robot": "visitor", "camera": "ceiling"})["items"], [])
        newest = self.get("listEvents", query={"robot": "visitor", "limit": 1})
        self.assertEqual([event["kind"] for event in newest["items"]], ["robot.removed"])

    def test_a_number_of_another_run_begins_anew(self):
        page = self.get("listEvents", query={"since": 10 ** 9, "limit": 1000})
        self.assertTrue(page["dropped"])
        self.assertEqual(page["items"][0]["sequence"], page["oldest"])


class Floor(Case):
    @classmethod
    def setUpClass(cls):
        mask = {"name": "shelf", "corners_m": [[1.2, -1.2], [1.8, -1.2], [1.8, -0.6]]}
        cls.own = Service(World.program, str(HERE / "room.json"), [f"floor.masks={json.dumps([mask])}"])
        cls.mask = mask

    @classmethod
    def tearDownClass(cls):
        assert cls.own.stop() == 0, cls.own.log()

    @property
    def service(self):
        return self.own

    def test_masks_and_what_cameras_see_of_the_floor_are_shown(self):
        floor = self.get("getFloor")
        self.assertEqual(floor["masks"], [self.mask])
        camera = floor["cameras"][0]
        self.assertEqual((camera["id"], camera["tags"]), ("ceiling", []))
        # 3 m above the middle, 460 px focal length, 640 x 480 px: the picture is square to the room.
        x, y = 319.5 * 3 / 460, 239.5 * 3 / 460
        for got, want in zip(sorted(camera["view_m"]), sorted(([a * x, b * y] for a in (-1, 0, 1) for b in (-1, 0, 1)
                                                              if a or b))):
            self.assertAlmostEqual(got[0], want[0], places=6)
            self.assertAlmostEqual(got[1], want[1], places=6)

    def test_a_pose_of_a_camera_that_hangs_still_has_no_warnings(self):
        self.assertEqual(self.pose_of("anna")["pose"]["warnings"], [])
