"""The simulator while it runs: scenarios, pace, what is done to the room, and robots that are driven."""
import time

from fixture import HERE, Case, World
from service import Service, wait_for


class Simulator(Case):
    @classmethod
    def setUpClass(cls):
        cls.own = Service(World.program, str(HERE / "room.json"))

    @classmethod
    def tearDownClass(cls):
        assert cls.own.stop() == 0, cls.own.log()

    @property
    def service(self):
        return self.own

    def setUp(self):
        self.call("loadScenario", 200, body={"scenario": "circle", "seed": 5})
        self.call("setSpeed", 200, body={"speed": 1})
        self.call("startSimulator", 200)

    def when(self, good):
        status = wait_for(lambda: self.get("getSimulator"), good, 60)
        self.assertTrue(good(status), status)
        return status

    def truth(self):
        return self.when(lambda s: s["robots"])["robots"][0]

    def test_scenarios_are_listed_and_loaded_by_name(self):
        page = self.get("listScenarios", query={"limit": 1000})
        names = [scenario["name"] for scenario in page["items"]]
        self.assertEqual(names, sorted(names))
        self.assertLessEqual({"demo", "circle", "straight"}, set(names))
        loaded = self.call("loadScenario", 200, body={"scenario": "straight"}).json()
        self.assertEqual((loaded["scenario"], loaded["state"]), ("straight", "running"))
        self.assertEqual(self.get("listCameras")["total"], len(loaded["cameras"]))
        told = self.get("listEvents", query={"kind": "simulator.scenario", "limit": 1})["items"][0]
        self.assertEqual(told["data"]["scenario"], "straight")
        self.problem("loadScenario", 422, "atlantis", body={"scenario": "atlantis"})
        self.problem("loadScenario", 422, "..", body={"scenario": "../scenarios/circle"})
        self.assertEqual(self.get("getSimulator")["scenario"], "straight", "the one before runs on")

    def test_it_stands_while_paused_and_goes_on_step_by_step(self):
        self.when(lambda s: s["robots"])
        self.assertEqual(self.call("pauseSimulator", 200).json()["state"], "paused")
        time.sleep(0.3)
        before = self.get("getSimulator")["time"]
        time.sleep(0.3)
        self.assertEqual(self.get("getSimulator")["time"], before)
        self.call("stepSimulator", 202, body={"frames": 2})
        after = self.when(lambda s: s["time"] > before + 0.05)
        self.assertLess(after["time"], before + 0.2)
        self.assertEqual(self.call("startSimulator", 200).json()["state"], "running")
        self.problem("stepSimulator", 409, "pause", body={"frames": 1})
        self.when(lambda s: s["time"] > after["time"] + 0.3)

    def test_depth_tells_how_the_floor_lies_and_how_high_a_robot_is(self):
        camera = wait_for(lambda: self.get("getCamera", {"id": "ceiling"}), lambda c: c["depth"] and c["depth"]["known"], 60)
        self.assertLess(abs(camera["depth"]["offset_m"]), 0.05, camera["depth"])
        robot = wait_for(lambda: self.get("getRobot", {"id": "waffle"}),
                         lambda r: r["status"]["measured_height"] and r["status"]["measured_height"]["frames"] > 20, 60)
        height = robot["status"]["measured_height"]
        # Its plate is 0.104 m above the floor; the lidar on it is no part of the picture.
        self.assertLess(abs(height["height_m"] - 0.104), 0.006, height)
        self.assertLess(height["sigma_m"], 0.01, height)

    def test_reset_begins_anew_and_the_speed_stays(self):
        self.call("setSpeed", 200, body={"speed": 2})
        self.when(lambda s: s["time"] > 0.5)
        again = self.call("resetSimulator", 200).json()
        self.assertLess(again["time"], 0.5)
        self.assertEqual((again["seed"], again["speed"]), (5, 2))
        self.problem("setSpeed", 422, "speed", "0.01", body={"speed": 0})

    def test_truth_and_pose_are_of_the_same_room_and_time(self):
        robot = self.get("listRobots")["items"][0]["id"]
        self.pose_of(robot)
        for _ in range(50):
            true = self.truth()
            answer = self.get("getPose", {"id": robot}, {"kind": "measured", "at": f"{true['at']:.6f}"}) \
                if self.instant_is_there(robot, true["at"]) else {"pose": None}
            if answer["pose"] is not None:
                self.assertAlmostEqual(answer["pose"]["x"], true["x"], delta=0.02)
                self.assertAlmostEqual(answer["pose"]["y"], true["y"], delta=0.02)
                return
            time.sleep(0.1)
        self.fail("no pose at any instant of the truth")

    def instant_is_there(self, robot, at):
        target = f"/api/v1/robots/{robot}/pose?kind=measured&at={at:.6f}"
        return self.service.request("GET", target).status == 200

    def test_what_is_asked_for_takes_place_and_is_told(self):
        robot = self.truth()["id"]
        self.call("actInSimulator", 202, body={"do": "light", "level": 0.7})
        taken = self.call("actInSimulator", 202, body={"do": "kidnap", "robot": robot, "away_s": 0,
                                                       "to": {"x_m": 0.5, "y_m": 0.4, "yaw_deg": 10}}).json()
        events = wait_for(lambda: self.get("listSimulatorEvents"), lambda page: page["total"] >= 2, 30)
        self.assertEqual([event["action"]["do"] for event in events["items"]][-2:], ["light", "kidnap"])
        self.assertGreaterEqual(events["items"][-1]["time"], taken["time"] - 0.1)
        later = self.get("listSimulatorEvents", query={"since": events["items"][-1]["time"]})
        self.assertEqual(later["total"], 0)
        self.problem("actInSimulator", 422, "nobody", body={"do": "power", "robot": "nobody", "on": False})
        self.problem("actInSimulator", 422, "level", body={"do": "light", "level": -1})

    def test_a_robot_is_driven_and_reports_its_odometry(self):
        robot = self.truth()["id"]
        self.call("driveRobot", 202, path={"id": robot}, body={"v_mps": 0, "w_radps": 0.5})
        wait_for(lambda: self.service.request("GET", f"/api/v1/robots/{robot}/odometry").status,
                 lambda status: status == 200, 30)
        report = self.get("getOdometry", {"id": robot})
        self.assertEqual((report["robot"], report["frame"]), (robot, "odom"))
        self.problem("getOdometry", 404, "nobody", path={"id": "nobody"})
        self.problem("driveRobot", 404, "nobody", path={"id": "nobody"}, body={"v_mps": 0, "w_radps": 0})
        self.problem("driveRobot", 422, "v_mps", path={"id": robot}, body={"v_mps": 50, "w_radps": 0})
