"""Where was, is, will be a robot: judged by the scenario and by what interpolation means."""
import csv
import io
import math
import re

from fixture import TRACKED_WITHIN_S, Case
from service import wait_for

# The scenario: anna drives a circle about this centre, ben stands.
CENTRE, RADIUS_M, SPEED_MPS = (-0.7, 0.0), 0.5, 0.2
BEN = (1.2, 0.8, 0.0)
HORIZON_S = 2.0


def turn(angle):
    return math.remainder(angle, 2 * math.pi)


class Poses(Case):
    def poses_now(self, good=lambda pose: True):
        """anna's newest answer whose pose is good."""
        answer = wait_for(lambda: self.pose_of("anna"), lambda a: good(a["pose"]), TRACKED_WITHIN_S)
        self.assertTrue(good(answer["pose"]), f"getPose: {answer}")
        return answer

    def test_a_robots_pose_moves_along_its_circle_and_stays_fresh(self):
        first = self.poses_now()
        later = self.poses_now(lambda pose: pose["captured"] > first["pose"]["captured"] + 2.0)
        for answer in (first, later):
            pose = answer["pose"]
            self.assertEqual((answer["robot"], pose["frame"], pose["kind"]), ("anna", "map", "filtered"))
            self.assertIn(answer["state"], ("tracking", "predicting"))
            self.assertAlmostEqual(math.dist((pose["x"], pose["y"]), CENTRE), RADIUS_M, delta=0.12)
            self.assertTrue(0 <= pose["age"] < HORIZON_S, f"getPose: age {pose['age']}")
            self.assertAlmostEqual(answer["published"] - pose["captured"], pose["age"], delta=1e-5)
            heading = math.atan2(pose["y"] - CENTRE[1], pose["x"] - CENTRE[0]) + math.pi / 2
            self.assertAlmostEqual(turn(pose["yaw"] - heading), 0, delta=0.6)
        moved = math.dist((first["pose"]["x"], first["pose"]["y"]), (later["pose"]["x"], later["pose"]["y"]))
        self.assertGreater(moved, 0.05, f"getPose: {first} {later}")

    def test_a_robot_that_stands_is_where_the_scenario_put_it(self):
        self.pose_of("ben")
        pose = self.pose_of("ben", kind="measured")["pose"]
        self.assertEqual(pose["kind"], "measured")
        self.assertIsNone(pose["velocity"])
        self.assertEqual(pose["cameras"], ["ceiling"])
        self.assertAlmostEqual(pose["x"], BEN[0], delta=0.02)
        self.assertAlmostEqual(pose["y"], BEN[1], delta=0.02)
        self.assertAlmostEqual(turn(pose["yaw"] - BEN[2]), 0, delta=0.05)
        covariance = pose["covariance"]
        self.assertTrue(all(covariance[i] > 0 for i in (0, 4, 8)), covariance)
        for i, j in ((1, 3), (2, 6), (5, 7)):
            self.assertAlmostEqual(covariance[i], covariance[j], delta=1e-9)

    def trajectory(self, robot="anna", **query):
        return self.get("getTrajectory", {"id": robot}, query)

    def neighbours(self):
        """Two poses of neighbouring frames, in the middle of what is kept."""
        self.poses_now()

        def found():
            points = self.trajectory()["points"]
            pairs = [(a, b) for a, b in zip(points, points[1:]) if b["captured"] - a["captured"] < 0.45]
            return pairs[len(pairs) // 2] if pairs else None
        pair = wait_for(found, bool, TRACKED_WITHIN_S)
        self.assertIsNotNone(pair, "getTrajectory: no neighbouring poses")
        return pair

    def test_an_instant_in_the_past_is_interpolated(self):
        before, after = self.neighbours()
        at = (before["captured"] + after["captured"]) / 2
        pose = self.get("getPose", {"id": "anna"}, {"at": f"{at:.6f}"})["pose"]
        self.assertEqual(pose["kind"], "filtered")
        self.assertAlmostEqual(pose["at"], at, delta=2e-6)
        self.assertAlmostEqual(pose["captured"], after["captured"], delta=2e-6)
        for key in ("x", "y"):
            self.assertAlmostEqual(pose[key], (before[key] + after[key]) / 2, delta=1e-5)
        self.assertAlmostEqual(turn(pose["yaw"] - before["yaw"]), turn(after["yaw"] - before["yaw"]) / 2, delta=1e-4)
        exact = self.get("getPose", {"id": "anna"}, {"at": f"{before['captured']:.6f}"})["pose"]
        self.assertAlmostEqual(exact["x"], before["x"], delta=1e-5)

    def test_all_robots_are_answered_for_at_one_instant(self):
        _, after = self.neighbours()
        self.pose_of("ben")
        page = self.get("listPoses", query={"at": f"{after['captured']:.6f}"})
        self.assertEqual({answer["robot"] for answer in page["items"]}, {"anna", "ben"})
        self.assertEqual(page["total"], 2)
        instants = {answer["pose"]["at"] for answer in page["items"] if answer["pose"]}
        self.assertEqual(len(instants), 1, page)
        short = self.get("listPoses", query={"limit": 1, "offset": 1})
        self.assertEqual([len(short["items"]), short["total"], short["limit"], short["offset"]], [1, 2, 1, 1])
        self.assertEqual(self.get("listPoses", query={"offset": 7})["items"], [])

    def test_an_instant_before_the_history_is_refused_naming_the_oldest(self):
        self.poses_now()
        detail = self.problem("getPose", 422, "oldest", path={"id": "anna"}, query={"at": 1000})
        oldest = float(re.findall(r"\d+\.\d+", detail)[-1])
        self.call("getPose", 200, {"id": "anna"}, {"at": f"{oldest + 1e-5:.6f}"})
        self.problem("getPose", 422, "oldest", path={"id": "anna"}, query={"at": f"{oldest - 1:.6f}"})
        self.problem("listPoses", 422, "oldest", query={"at": 1000})

    def test_an_instant_ahead_is_predicted(self):
        def ask():
            now = self.poses_now()
            at = round(now["published"] + 0.5, 6)
            return now, at, self.get("getPose", {"id": "anna"}, {"at": f"{at:.6f}"})

        def ahead(asked):
            return asked[2]["pose"] and asked[2]["pose"]["kind"] == "predicted"
        now, at, answer = wait_for(ask, ahead, TRACKED_WITHIN_S)
        pose = answer["pose"]
        self.assertEqual((pose["kind"], pose["source"]), ("predicted", "prediction"), answer)
        self.assertAlmostEqual(pose["at"], at, delta=2e-6)
        self.assertAlmostEqual(pose["horizon"], at - pose["captured"], delta=1e-5)
        apart = math.dist((pose["x"], pose["y"]), (now["pose"]["x"], now["pose"]["y"]))
        self.assertLess(apart, 2 * SPEED_MPS * (at - now["pose"]["captured"]) + 0.1, answer)

    def test_now_can_be_predicted(self):
        for query in ({"kind": "predicted"}, {"at": "now"}, {"at": "now", "kind": "predicted"}):
            with self.subTest(query=query):
                answer = self.pose_of("anna", **query)
                pose = answer["pose"]
                self.assertEqual(pose["kind"], "predicted")
                self.assertAlmostEqual(pose["at"], answer["published"], delta=2e-6)
                self.assertAlmostEqual(pose["horizon"], pose["age"], delta=2e-6)
        for answer in self.get("listPoses", query={"at": "now"})["items"]:
            self.assertIn((answer["pose"] or pose)["kind"], ("predicted",), answer)
        self.problem("getPose", 400, "soon", "now", "Unix seconds", path={"id": "anna"}, query={"at": "soon"})

    def test_smoothed_poses_are_there_final_or_not(self):
        newest = self.pose_of("anna", kind="smoothed")["pose"]
        self.assertEqual((newest["kind"], newest["horizon"]), ("smoothed", 0))
        self.poses_now(lambda pose: pose["captured"] > newest["captured"] + 2.5)
        final = self.get("getPose", {"id": "anna"}, {"kind": "smoothed", "at": f"{newest['captured']:.6f}"})["pose"]
        self.assertEqual((final["kind"], final["captured"]), ("smoothed", newest["captured"]))
        self.assertLess(math.dist((final["x"], final["y"]), (newest["x"], newest["y"])), 0.05)
        self.assertLessEqual(final["covariance"][0], newest["covariance"][0])
        points = self.trajectory(kind="smoothed")
        self.assertEqual(points["kind"], "smoothed")
        times = [p["captured"] for p in points["points"]]
        self.assertEqual(times, sorted(set(times)))
        self.assertIn(newest["captured"], times)

    def test_a_filter_without_a_smoother_says_so(self):
        self.addCleanup(self.service.request, "DELETE", "/api/v1/robots/paper")
        self.call("addRobot", 201, body={"id": "paper", "appearance": "anna", "filter": {"type": "window"}})
        for operation in ("getPose", "getTrajectory"):
            self.problem(operation, 422, "smoothed", "no smoother", path={"id": "paper"}, query={"kind": "smoothed"})

    def test_questions_without_an_answer_are_refused(self):
        now = self.poses_now()["published"]
        for query, words in (({"at": now + 3600}, ("at", "horizon")),
                             ({"at": now + 1.5, "kind": "measured"}, ("measured",)),
                             ({"at": now + 1.5, "kind": "smoothed"}, ("smoothed",)),
                             ({"at": now - 0.5, "kind": "predicted"}, ("predicted",)),
                             ({"at": "now", "kind": "filtered"}, ("filtered", "now", "predicted")),
                             ({"at": "now", "kind": "smoothed"}, ("smoothed", "now", "predicted"))):
            with self.subTest(query=query):
                self.problem("getPose", 422, *words, path={"id": "anna"}, query=query)
                self.problem("listPoses", 422, *words, query=query)

    def test_a_trajectory_is_in_order_within_its_bounds_and_the_same_in_each_format(self):
        _, last = self.neighbours()
        whole = self.trajectory()
        times = [p["captured"] for p in whole["points"]]
        self.assertEqual(times, sorted(set(times)))
        query = {"from": f"{times[0]:.6f}", "to": f"{last['captured'] + 1e-6:.6f}"}
        part = self.trajectory(**query)
        self.assertTrue(part["points"], part)
        self.assertLessEqual(part["points"][-1]["captured"], last["captured"] + 2e-6)
        rows = list(csv.DictReader(io.StringIO(self.text("csv", query))))
        lines = [[float(v) for v in line.split()] for line in self.text("tum", query).splitlines()]
        self.assertEqual([len(rows), len(lines)], [len(part["points"])] * 2)
        for point, row, line in zip(part["points"], rows, lines):
            self.assertEqual((row["robot"], row["kind"], row["state"]), ("anna", "filtered", point["state"]))
            self.assertAlmostEqual(float(row["captured"]), point["captured"], delta=2e-6)
            for key in ("x", "y", "yaw"):
                self.assertAlmostEqual(float(row[key]), point[key], delta=1e-6)
            self.assertAlmostEqual(float(row["cov_xyaw"]), point["covariance"][2], delta=1e-6)
            self.assertAlmostEqual(math.dist(line[1:3], (point["x"], point["y"])), 0, delta=1e-6)
            self.assertAlmostEqual(turn(2 * math.atan2(line[6], line[7]) - point["yaw"]), 0, delta=1e-6)

    def text(self, form, query):
        return self.call("getTrajectory", 200, {"id": "anna"}, {**query, "format": form}).body.decode()

    def test_a_trajectory_of_measured_poses_has_no_velocity_and_one_backwards_is_refused(self):
        self.poses_now()
        points = self.trajectory(kind="measured")["points"]
        self.assertTrue(points)
        self.assertEqual({str(p["velocity"]) for p in points}, {"None"})
        self.problem("getTrajectory", 422, "from", path={"id": "anna"}, query={"from": 2000, "to": 1000})
        self.problem("getTrajectory", 422, "predicted", path={"id": "anna"}, query={"kind": "predicted"})
        self.assertEqual(self.trajectory(to=1000)["points"], [])
