"""What took place: numbered events, read from where one was."""
from fixture import Case


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
