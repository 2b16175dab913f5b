"""A robot's own geometry: measured while it turns, taken over, cancelled."""
import math
import time

from fixture import Case
from service import wait_for

ROBOT = "ben"  # who stands, unless he is told to turn


class Geometry(Case):
    def tearDown(self):
        self.service.request("DELETE", f"/api/v1/robots/{ROBOT}/geometry")

    def begin(self, **known):
        return self.call("measureGeometry", 201, {"id": ROBOT}, body=known).json()

    def test_a_turn_on_the_spot_tells_the_reference_point(self):
        before = self.get("getRobot", {"id": ROBOT})
        self.pose_of(ROBOT)
        begun = self.begin(distance={"length_m": 2})
        self.assertEqual(begun["known"]["distance"], {"length_m": 2, "sigma_m": 0.001})
        self.problem("applyGeometry", 409, "turn on the spot", path={"id": ROBOT})
        told = self.call("tellGeometry", 200, {"id": ROBOT}, body={"distance": {"length_m": 3}}).json()
        self.assertEqual((told["known"]["distance"]["length_m"], told["since"]), (3, begun["since"]))

        def told():
            self.call("driveRobot", 202, {"id": ROBOT}, body={"v_mps": 0, "w_radps": 1.2})  # for half a second
            time.sleep(0.2)
            return self.get("getGeometry", {"id": ROBOT})["result"]

        result = wait_for(told, lambda r: r["figures"]["mounting_x_m"]["measured"] is not None, 60)
        figures = result["figures"]
        self.assertIsNotNone(figures["mounting_x_m"]["measured"], result)
        self.assertGreater(result["covered"]["spun_rad"], 1)
        self.assertIsNone(figures["surface_height_m"]["measured"], "one place, and a distance between two")
        self.assertIn("place", figures["surface_height_m"]["missing"])
        changed = self.call("applyGeometry", 200, {"id": ROBOT}).json()
        place = changed["picture_mounting"]["position_m"]
        appearance = next(a for a in self.get("listAppearances")["items"] if a["id"] == before["appearance"])
        truth = [-p for p in appearance["reference_point_m"]]  # the simulator's robots are built as they are told
        self.assertLess(math.dist(place, truth), 0.005, f"{place} {truth}")
        self.problem("getGeometry", 404, ROBOT, path={"id": ROBOT})
        self.call("changeRobot", 200, {"id": ROBOT}, body={"picture_mounting": {"position_m": truth}})

    def test_it_is_cancelled(self):
        self.begin()
        self.call("cancelGeometry", 204, {"id": ROBOT})
        self.problem("cancelGeometry", 404, ROBOT, path={"id": ROBOT})
        self.problem("getGeometry", 404, "POST", path={"id": ROBOT})

    def test_what_is_no_knowledge_is_refused(self):
        for body, words in (({"distance": {"length_m": 0.01}}, ("length_m", "0.1")), ({"distance": {}}, ("length_m",)),
                            ({"radius": {"length_m": 1, "sigma_m": 2}}, ("sigma_m", "1")), ({"wheels": 3}, ("wheels",)),
                            ({"holonomic": 1}, ("holonomic",))):
            with self.subTest(body=body):
                self.problem("measureGeometry", 422, *words, path={"id": ROBOT}, body=body)
        self.problem("tellGeometry", 404, "POST", path={"id": ROBOT}, body={})
        self.problem("measureGeometry", 404, "nobody", path={"id": "nobody"}, body={})
        self.problem("applyGeometry", 404, "nobody", path={"id": "nobody"})
