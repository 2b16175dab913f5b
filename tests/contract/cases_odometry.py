"""What robots say of themselves: taken, brought to our clock, read back, and gone with the robot."""
import time

from fixture import Case

ROBOT = "talker"


class Odometry(Case):
    def setUp(self):
        self.addCleanup(self.service.request, "DELETE", f"/api/v1/robots/{ROBOT}")
        self.call("addRobot", 201, body={"id": ROBOT, "appearance": "anna"})

    def say(self, body):
        return self.call("postOdometry", 202, {"id": ROBOT}, body=body).json()

    def test_a_reading_is_taken_and_read_back(self):
        self.problem("getOdometry", 404, ROBOT, path={"id": ROBOT})
        now = time.time()
        receipt = self.say({"stamp": now, "v_mps": 0.2, "w_radps": -0.5})
        self.assertEqual((receipt["robot"], receipt["accepted"], receipt["ignored"]), (ROBOT, 1, 0))
        self.assertLess(abs(receipt["clock_offset_s"]), 5, "the same machine's clock")
        said = self.get("getOdometry", {"id": ROBOT})
        self.assertAlmostEqual(said["stamp"], now, delta=2e-6)
        self.assertEqual((said["pose"], said["twist"]), (None, {"v_mps": 0.2, "side_mps": 0, "w_radps": -0.5}))

    def test_a_clock_of_its_own_is_found_out(self):
        ahead = 1000.0
        for _ in range(5):
            receipt = self.say([{"stamp": time.time() + ahead, "v_mps": 0, "w_radps": 0},
                                {"v_mps": 0, "w_radps": 0, "kind": "command"}])
            self.assertGreaterEqual(receipt["accepted"], 1, receipt)
            time.sleep(0.02)
        self.assertLess(receipt["clock_offset_s"], ahead)
        self.assertGreater(receipt["clock_offset_s"], ahead - 5)

    def test_what_is_old_or_of_no_use_is_told(self):
        now = time.time()
        receipt = self.say([{"stamp": now - 60, "v_mps": 0, "w_radps": 0}, {"stamp": now, "v_mps": 0, "w_radps": 0}])
        self.assertEqual((receipt["accepted"], receipt["ignored"]), (1, 1), receipt)
        self.assertIn("older than the newest frame", receipt["reason"])
        self.call("changeRobot", 200, {"id": ROBOT}, body={"filter": {"type": "window"}})
        receipt = self.say({"v_mps": 0, "w_radps": 0})
        self.assertEqual((receipt["accepted"], receipt["ignored"]), (0, 1), receipt)
        self.assertIn("window", receipt["reason"])

    def test_what_is_no_reading_is_refused(self):
        good = {"v_mps": 0.1, "w_radps": 0}
        for body, words in (([], ("1 to 1000",)), ([good] * 1001, ("1001", "1 to 1000")), ({"v_mps": 1}, ("w_radps",)),
                            ({**good, "v_mps": 51}, ("v_mps", "51", "50")), ([good, 7], ("[1]",)),
                            ({**good, "covariance": [0] * 9}, ("covariance", "positive definite")),
                            ({**good, "covariance": [1] * 8}, ("covariance", "9")),
                            ({**good, "kind": "guess"}, ("kind", "guess")), ({**good, "at": 5}, ("at",))):
            with self.subTest(body=str(body)[:80]):
                self.problem("postOdometry", 422, "body", *words, path={"id": ROBOT}, body=body)

    def test_it_is_gone_with_its_robot(self):
        self.say({"stamp": 5, "v_mps": 0, "w_radps": 0})
        self.call("removeRobot", 204, {"id": ROBOT})
        self.problem("postOdometry", 404, ROBOT, path={"id": ROBOT}, body={"v_mps": 0, "w_radps": 0})
        self.call("addRobot", 201, body={"id": ROBOT, "appearance": "anna"})
        self.problem("getOdometry", 404, ROBOT, path={"id": ROBOT})
