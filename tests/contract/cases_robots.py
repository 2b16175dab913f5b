"""Robots, appearances and cameras: what is added is there, what is changed shows, what is removed is gone."""
import math
import re

from fixture import CONFIGURED_GATE, Case

COPY = "copy"


def leaves(contract, schema, path=(), beside=None):
    """Each value of an object's schema, with its path and what must stand beside it: ("filter", "gate"), {...},
    {"type": "motion"}."""
    schema = contract.resolve(schema)
    for each in schema.get("anyOf", []):
        kind = contract.resolve(each)["properties"]["type"]["const"]
        yield from leaves(contract, each, path, {"type": kind})
    if "anyOf" in schema:
        return
    if "properties" not in schema:
        yield path, schema, beside or {}
        return
    needed = {name: [0] * contract.resolve(schema["properties"][name]).get("minItems", 0) or 0
              for name in schema.get("required", [])}
    for name, part in schema["properties"].items():
        yield from leaves(contract, part, path + (name,), beside or needed)


def nested(path, value):
    for name in reversed(path):
        value = {name: value}
    return value


def bad_values(schema):
    """(value, what the refusal must name) for values that the schema does not allow."""
    if "enum" in schema or "const" in schema:
        return [("nonsense", "nonsense"), (7, ""), (None, "")]
    if schema["type"] == "boolean":
        return [("true", ""), (1, "")]
    if schema["type"] == "array":
        inner = schema["items"]
        return [([0], ""), (7, ""), ([inner["maximum"] + 1] + [0] * (schema["minItems"] - 1), inner["maximum"])]
    if schema["type"] == "string":
        return [("", ""), (7, ""), ("a/b", "a/b")]
    low, high = schema.get("minimum", schema.get("exclusiveMinimum")), schema["maximum"]
    below = low if "exclusiveMinimum" in schema else low - 1
    return [(below, low), (high + 1, high), ("1", "number"), (True, "number"), (None, "")]


class Robots(Case):
    def setUp(self):
        self.service.request("DELETE", f"/api/v1/robots/{COPY}")
        self.addCleanup(self.service.request, "DELETE", f"/api/v1/robots/{COPY}")

    def add_copy(self, **settings):
        return self.call("addRobot", 201, body={"id": COPY, "appearance": "anna", **settings})

    def test_robots_of_the_scenario_are_listed_with_their_settings(self):
        page = self.get("listRobots")
        self.assertEqual([robot["id"] for robot in page["items"]], ["anna", "ben"])
        for robot in page["items"]:
            self.assertEqual(robot["filter"]["gate"], CONFIGURED_GATE)
            self.assertEqual(robot, {**self.get("getRobot", {"id": robot["id"]}), "status": robot["status"]})

    def test_a_robot_is_added_changed_and_removed(self):
        added = self.add_copy()
        self.assertEqual(added.headers["location"], f"/api/v1/robots/{COPY}")
        robot = self.service.request("GET", added.headers["location"]).json()
        self.assertEqual((robot["id"], robot["appearance"], robot["status"]["copies"]), (COPY, "anna", 2))
        self.assertEqual(self.get("listRobots")["total"], 3)

        changed = self.call("changeRobot", 200, {"id": COPY}, body={"filter": {"gate": 12}}).json()
        shown = self.get("getRobot", {"id": COPY})
        self.assertEqual(shown["filter"], {**robot["filter"], "gate": 12})
        self.assertEqual(changed["filter"], shown["filter"])
        for key in ("appearance", "detector", "homography"):
            self.assertEqual(shown[key], robot[key])

        self.call("removeRobot", 204, {"id": COPY})
        for operation in ("getRobot", "getPose", "getTrajectory", "removeRobot"):
            self.problem(operation, 404, COPY, path={"id": COPY})
        self.problem("changeRobot", 404, COPY, path={"id": COPY}, body={"filter": {"gate": 12}})
        self.assertEqual(self.get("listRobots")["total"], 2)

    def test_a_robot_that_is_added_takes_what_the_configuration_says(self):
        self.assertEqual(self.add_copy().json()["filter"]["gate"], CONFIGURED_GATE)

    def test_a_robot_takes_another_filter_with_that_ones_defaults(self):
        self.add_copy()
        window = self.call("changeRobot", 200, {"id": COPY}, body={"filter": {"type": "window"}}).json()["filter"]
        self.assertEqual((window["type"], window["window_size"], window["alpha"]), ("window", 12, 0.3))
        motion = self.call("changeRobot", 200, {"id": COPY}, body={"filter": {"type": "motion"}}).json()["filter"]
        self.assertEqual((motion["type"], motion["gate"]), ("motion", 16.3))
        self.problem("changeRobot", 422, "filter.type", "kalman", path={"id": COPY}, body={"filter": {"type": "kalman"}})

    def test_what_a_robot_says_itself_is_kept(self):
        said = {"surface_height_m": 0.2, "detector": "homography", "filter": {"type": "window", "window_size": 7},
                "homography": {"drop": "ray", "reference_m": [0.1, -0.2]},
                "initial_pose": {"x_m": 0.5, "y_m": -0.5, "yaw_rad": 1}}
        robot = self.add_copy(**said).json()
        for key, value in said.items():
            shown = {k: robot[key][k] for k in value} if isinstance(value, dict) else robot[key]
            self.assertEqual(shown, value, key)

    def test_a_robot_with_a_tag_needs_no_picture(self):
        tag = {"family": "25h9", "id": 9, "size_m": 0.12, "height_m": 0.2, "position_m": [0.1, -0.05], "yaw_rad": 0.5}
        robot = self.call("addRobot", 201, body={"id": COPY, "detector": "apriltag", "tag": tag}).json()
        self.assertNotIn("appearance", robot)
        self.assertEqual((robot["tag"], robot["status"]["size_m"], robot["status"]["copies"]), (tag, [0.12, 0.12], 1))
        changed = self.call("changeRobot", 200, {"id": COPY}, body={"tag": {"id": 10}}).json()
        self.assertEqual(changed["tag"], {**tag, "id": 10})
        self.problem("changeRobot", 422, "tag", "0 to 34", path={"id": COPY}, body={"tag": {"id": 35}})

    def test_a_tag_that_another_robot_has_is_refused(self):
        self.add_copy(tag={"id": 9})
        other = {"id": "other", "detector": "apriltag", "tag": {"id": 9}}
        self.problem("addRobot", 422, "36h11 9", COPY, body=other)
        self.problem("addRobot", 422, "apriltag", "tag", body={"id": "other", "detector": "apriltag"})

    def test_a_robot_that_is_there_or_looks_like_nothing_is_refused(self):
        self.problem("addRobot", 409, "anna", body={"id": "anna"})
        self.problem("addRobot", 422, "appearance", "nobody", body={"id": COPY, "appearance": "nobody"})
        self.problem("addRobot", 422, "appearance", COPY, body={"id": COPY})
        self.problem("addRobot", 422, "id", body={"appearance": "anna"})
        self.problem("addRobot", 422, "speed", body={"id": COPY, "appearance": "anna", "speed": 3})
        self.problem("getRobot", 404, COPY, path={"id": COPY})

    def test_a_change_out_of_range_is_refused_naming_key_value_and_range(self):
        self.add_copy()
        self.problem("changeRobot", 422, "filter.gate", "5000", "1000", path={"id": COPY},
                     body={"filter": {"gate": 5000}})
        self.problem("changeRobot", 422, "id", path={"id": COPY}, body={"id": "other"})
        self.problem("changeRobot", 422, "gaet", "gate", path={"id": COPY}, body={"filter": {"gaet": 12}})
        self.problem("changeRobot", 422, "alpha", path={"id": COPY}, body={"filter": {"type": "motion", "alpha": 0.2}})
        self.assertEqual(self.get("getRobot", {"id": COPY})["filter"]["gate"], CONFIGURED_GATE)

    def test_every_setting_takes_the_ends_of_its_range_and_nothing_beyond(self):
        self.add_copy()
        for path, schema, beside in leaves(self.contract, {"$ref": "#/components/schemas/RobotChange"}):
            if path[0] == "tag" and path[-1] != "family":  # the one with the most tags
                beside = {**beside, "family": "Standard41h12"}

            def body_with(value):
                return nested(path[:1], {**beside, **nested(path[1:], value)} if len(path) > 1 else value)

            for value, named in bad_values(schema):
                body = body_with(value)
                with self.subTest(key=".".join(path), value=value):
                    words = () if isinstance(named, (int, float)) else (named,)
                    detail = self.problem("changeRobot", 422, path[-1], *words, path={"id": COPY}, body=body)
                    if not words:
                        numbers = [float(n) for n in re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", detail)]
                        self.assertIn(named, numbers, detail)
            for value in [schema[end] for end in ("minimum", "maximum") if end in schema] + schema.get("enum", []):
                body = body_with(value)
                with self.subTest(key=".".join(path), value=value):
                    shown = self.call("changeRobot", 200, {"id": COPY}, body=body).json()
                    for name in path:
                        shown = shown[name]
                    if path[-1] == "yaw_rad":  # any turn of it is the same heading
                        shown = math.remainder(shown - value, 2 * math.pi)
                        self.assertLess(abs(shown), 1e-9)
                    else:
                        self.assertEqual(shown, value)

    def test_a_robot_that_was_not_found_yet_has_no_pose_but_a_reason(self):
        self.add_copy()
        answer = self.get("getPose", {"id": COPY})
        if answer["pose"] is None:  # it may have been taken for anna where she is covered, but that says so too
            self.assertTrue(answer["reason"])
            self.assertIn(answer["state"], ("searching", "calibrating", "lost"))


class Appearances(Case):
    def box_around(self, robot):
        """A box on the newest frame, by a projection of our own (a pinhole without distortion)."""
        pose = self.pose_of(robot, kind="measured")["pose"]
        camera = self.get("getCamera", {"id": "ceiling"})
        lens, place = camera["intrinsics"], camera["map_from_camera"]
        x, y, z, w = place["quaternion_xyzw"]
        right = (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w))
        down = (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w))
        ahead = (2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y))
        height = next(a for a in self.get("listAppearances")["items"] if a["id"] == robot)["surface_height_m"]
        away = [p - c for p, c in zip((pose["x"], pose["y"], height), place["position_m"])]
        depth = sum(a * b for a, b in zip(ahead, away))
        column = lens["cx_px"] + lens["fx_px"] * sum(a * b for a, b in zip(right, away)) / depth
        row = lens["cy_px"] + lens["fy_px"] * sum(a * b for a, b in zip(down, away)) / depth
        return pose, height, [round(column) - 20, round(row) - 20, 40, 40]

    def test_an_appearance_is_cut_from_the_current_frame_and_a_robot_takes_it(self):
        pose, height, box = self.box_around("ben")
        settings = {"id": "cut", "surface_height_m": height,
                    "cut_from_frame": {"camera": "ceiling", "box_px": box, "yaw_rad": 0.5}}
        added = self.call("addAppearance", 201, body=settings).json()
        cut = added.pop("cut_pose")
        self.assertLess(math.dist((cut["x"], cut["y"]), (pose["x"], pose["y"])), 0.12, f"{cut} {pose}")
        self.assertAlmostEqual(cut["yaw"], 0.5, delta=1e-9)
        self.assertIn(added, self.get("listAppearances")["items"])
        self.problem("addAppearance", 409, "cut", body=settings)
        self.call("addRobot", 201, body={"id": "cutter", "appearance": "cut"})
        self.call("removeRobot", 204, {"id": "cutter"})

    def test_boxes_that_cannot_be_cut_are_refused(self):
        for box, words in (([600, 100, 100, 40], ("box", "640", "480")), ([100, 470, 40, 40], ("box",)),
                           ([10, 10, 4, 40], ("box_px",)), ([-5, 10, 40, 40], ("box_px", "-5")),
                           ([10, 10, 40], ("box_px",)), ([10, 10, 70000, 40], ("box_px", "65535")),
                           ([60000, 60000, 60, 60], ("box",))):
            with self.subTest(box=box):
                self.problem("addAppearance", 422, *words,
                             body={"id": "refused", "cut_from_frame": {"camera": "ceiling", "box_px": box}})

    def test_other_ways_to_an_appearance_are_refused(self):
        cut = {"camera": "ceiling", "box_px": [100, 100, 40, 40]}
        for more, words in (({"image": "/etc/passwd", "metres_per_pixel": 0.01}, ("image",)),
                            ({"image": "x.png", "cut_from_frame": cut}, ("image",)),
                            ({"cut_from_frame": {**cut, "camera": "cellar"}}, ("camera", "cellar")),
                            ({"cut_from_frame": cut, "surface_height_m": 9}, ("surface_height_m", "9", "5")),
                            ({"cut_from_frame": cut, "surface_height_m": 4}, ("plane",)),
                            ({"cut_from_frame": cut, "reference_point_m": [9, 0]}, ("reference_point_m", "5"))):
            with self.subTest(more=more):
                self.problem("addAppearance", 422, *words, body={"id": "refused", **more})
        self.assertNotIn("refused", [a["id"] for a in self.get("listAppearances")["items"]])


class Cameras(Case):
    def test_the_camera_is_the_scenarios(self):
        page = self.get("listCameras")
        self.assertEqual([camera["id"] for camera in page["items"]], ["ceiling"])
        camera = self.get("getCamera", {"id": "ceiling"})
        self.assertEqual([camera["intrinsics"][k] for k in ("width_px", "height_px", "fx_px", "cx_px")],
                         [640, 480, 460, 319.5])
        self.assertEqual(camera["map_from_camera"]["position_m"], [0, 0, 3])
        self.assertGreater(camera["frames"], 0)

    def test_a_snapshot_is_a_jpeg_of_the_size_that_was_asked_for(self):
        def size(jpeg):
            at = 2
            while jpeg[at + 1] not in (0xC0, 0xC2):  # to the frame header
                at += 2 + int.from_bytes(jpeg[at + 2:at + 4], "big")
            return int.from_bytes(jpeg[at + 7:at + 9], "big"), int.from_bytes(jpeg[at + 5:at + 7], "big")
        for query, wanted in (({}, (640, 480)), ({"width": 320}, (320, 240)),
                              ({"width": 64, "overlay": "false"}, (64, 48)), ({"overlay": "false"}, (640, 480))):
            answer = self.call("getSnapshot", 200, {"id": "ceiling"}, query)
            self.assertTrue(answer.body.startswith(b"\xff\xd8"), query)
            self.assertEqual(size(answer.body), wanted, query)
            published = self.get("listPoses")["items"][0]["published"]
            self.assertLess(abs(float(answer.headers["skylight-captured"]) - published), 60)
