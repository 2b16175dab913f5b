"""Calibrations over the running service: a posted camera before which a board is held, and clicked points."""
import json
import math
import pathlib
import struct
import tempfile
import time
import zlib

from fixture import Case, World
from service import Service, wait_for

WIDTH, HEIGHT, FOCAL = 320, 240, 300.0
COLUMNS, ROWS, SQUARE = 5, 4, 0.1
BOARD = f"chessboard:{COLUMNS}x{ROWS}:{SQUARE}"


def grey(u, v, tilt_x, tilt_y, middle):
    """What a chessboard 1.6 m before a pinhole shows at a pixel: dark, light, or the grey around it."""
    ray = ((u - (WIDTH - 1) / 2) / FOCAL, (v - (HEIGHT - 1) / 2) / FOCAL, 1.0)
    cx, sx, cy, sy = math.cos(tilt_x), math.sin(tilt_x), math.cos(tilt_y), math.sin(tilt_y)
    right = (cy, sx * sy, -cx * sy)
    down = (0.0, cx, sx)
    ahead = (sy, -sx * cy, cx * cy)
    distance = sum(a * m for a, m in zip(ahead, middle)) / sum(a * r for a, r in zip(ahead, ray))
    place = [distance * r - m for r, m in zip(ray, middle)]
    x = sum(a * p for a, p in zip(right, place)) / SQUARE + (COLUMNS + 1) / 2
    y = sum(a * p for a, p in zip(down, place)) / SQUARE + (ROWS + 1) / 2
    if not (-1 < x < COLUMNS + 2 and -1 < y < ROWS + 2):
        return 110
    inside = 0 <= x < COLUMNS + 1 and 0 <= y < ROWS + 1
    return 30 if inside and (int(x) + int(y)) % 2 == 0 else 200


def board_png(tilt_x, tilt_y, middle):
    rows = []
    for v in range(HEIGHT):
        row = bytearray([0])  # no filter
        for u in range(WIDTH):
            row.append(sum(grey(u + a, v + b, tilt_x, tilt_y, middle) for a in (-0.25, 0.25) for b in (-0.25, 0.25)) // 4)
        rows.append(bytes(row))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"".join(rows))) + chunk(b"IEND", b"")


def points(flip=1):
    """Clicked points of a camera 3.1 m above the floor, 0.1 m beside where the configuration has it."""
    return [{"u_px": (WIDTH - 1) / 2 + FOCAL * (x - 0.1) / 3.1, "v_px": (HEIGHT - 1) / 2 - FOCAL * y / 3.1,
             "x_m": x, "y_m": flip * y} for x in (-1.2, 0.1, 1) for y in (-0.8, 0.2, 0.9)]


class Calibration(Case):
    CAMERA = {"id": "ceiling"}

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.file = cls.folder / "room.json"
        cls.file.write_text(json.dumps({
            "source": {"type": "cameras"}, "calibration_dir": "calibrations",
            "cameras": [{"id": "ceiling", "source": {"type": "posted"},
                         "overhead": {"height_m": 3, "metres_per_pixel": 3 / FOCAL, "size_px": [WIDTH, HEIGHT]}}]}),
            encoding="utf-8")
        cls.room = Service(World.program, config=str(cls.file), ready=False)

    @classmethod
    def tearDownClass(cls):
        assert cls.room.stop() == 0, cls.room.log()

    @property
    def service(self):
        return self.room

    def calibration(self):
        answer = self.call("getCalibration", 200, self.CAMERA)
        return answer.json(), answer.headers["etag"]

    def put(self, expect, document, **headers):
        return self.call("putCalibration", expect, self.CAMERA, body=document, headers=headers)

    def test_an_edited_document_is_in_use_kept_and_restored(self):
        since = self.get("listEvents")["next"]
        document, tag = self.calibration()
        document["map_from_camera"]["position_m"][0] += 0.5
        document["note"] = "moved by hand"
        self.problem("putCalibration", 428, "If-Match", path=self.CAMERA, body=document)
        self.problem("putCalibration", 412, tag, path=self.CAMERA, body=document, headers={"If-Match": '"other"'})
        changed = self.put(200, document, **{"If-Match": tag})
        self.assertEqual((changed.json()["stored"], changed.json()["calibration"]), (True, document))
        self.assertEqual(changed.headers["etag"], self.calibration()[1])
        shown = self.get("getCamera", self.CAMERA)["map_from_camera"]["position_m"]
        self.assertEqual(shown, document["map_from_camera"]["position_m"])
        file = self.folder / "calibrations" / "ceiling.json"
        self.assertEqual(json.loads(file.read_text(encoding="utf-8")), document)
        again = Service(World.program, config=str(self.file), ready=False)
        self.assertEqual(again.request("GET", "/api/v1/cameras/ceiling/calibration").json(), document, "after a restart")
        self.assertEqual(again.stop(), 0)

        version = str(changed.json()["version"])
        listed = self.get("listCalibrationVersions", self.CAMERA)
        self.assertIn(int(version), [each["number"] for each in listed["items"]])
        kept = self.call("getCalibrationVersion", 200, {**self.CAMERA, "number": version})
        self.assertEqual(kept.headers["etag"], tag)
        restored = self.call("restoreCalibration", 200, self.CAMERA, body={"version": int(version)}).json()
        self.assertEqual((restored["restored"], self.calibration()[1]), (int(version), tag))
        self.problem("getCalibrationVersion", 404, "9999", path={**self.CAMERA, "number": "9999"})
        self.problem("restoreCalibration", 404, "9999", path=self.CAMERA, body={"version": 9999})
        events = self.get("listEvents", query={"since": since, "kind": "calibration.changed"})["items"]
        self.assertEqual([(event["camera"], event["data"]["shift_mm"]) for event in events], [("ceiling", 500.0)] * 2)

    def test_documents_that_are_none_are_refused(self):
        document, tag = self.calibration()
        for key, value, words in (("fx_px", -3, ("intrinsics.fx_px", "-3", "allowed")), ("width_px", 640, ("640 x 240",)),
                                  ("lens", "fish", ("intrinsics.lens", "kannala_brandt"))):
            wrong = {**document, "intrinsics": {**document["intrinsics"], key: value}}
            self.problem("putCalibration", 422, *words, path=self.CAMERA, body=wrong, headers={"If-Match": tag})
        self.assertEqual(self.calibration()[1], tag)

    def test_clicked_points_tell_where_the_camera_hangs(self):
        before = self.calibration()[1]
        looked = self.call("calibrateExtrinsics", 200, self.CAMERA, body={"points": points(), "apply": False}).json()
        change = looked["cameras"][0]["change"]
        self.assertAlmostEqual(change["shift_mm"], 1e3 * math.hypot(0.1, 0.1), delta=1)
        self.assertLess(change["turn_deg"], 0.05)
        self.assertEqual((looked["applied"], self.calibration()[1]), (False, before))
        body = {"cameras": ["ceiling"], "points": points()}
        self.assertTrue(self.call("calibrateJointly", 200, body=body).json()["applied"])
        position = self.calibration()[0]["map_from_camera"]["position_m"]
        for value, truth in zip(position, (0.1, 0, 3.1)):
            self.assertAlmostEqual(value, truth, delta=1e-3)
        axis = {"origin_px": [100, 100], "x_axis_px": [100, 50]}
        self.call("calibrateExtrinsics", 200, self.CAMERA, body={"map": axis, "apply": False})
        for body, words in (({"points": points(-1)}, ("ceiling", "mirrored")), ({"points": points()[:3]}, ("4 points",)),
                            ({}, ("tags",)), ({"map": {**axis, "origin_px": [9999, 1]}}, ("map.origin_px",))):
            self.problem("calibrateExtrinsics", 422, *words, path=self.CAMERA, body=body)
        self.problem("calibrateJointly", 422, "attic", body={"cameras": ["attic"], "points": points()})
        self.call("restoreCalibration", 200, self.CAMERA, body={})

    def test_a_board_that_is_held_before_the_camera_gives_its_lens(self):
        self.problem("getIntrinsics", 404, "ceiling", path=self.CAMERA)
        self.problem("startIntrinsics", 422, "board", "chessboard:9x6:0.025", path=self.CAMERA, body={"board": "5x4"})
        begun = self.call("startIntrinsics", 201, self.CAMERA, body={"board": BOARD, "model": "pinhole"})
        self.assertEqual(begun.headers["location"], "/api/v1/cameras/ceiling/calibration/intrinsics")
        self.problem("startIntrinsics", 409, "ceiling", path=self.CAMERA, body={"board": BOARD})
        self.problem("finishIntrinsics", 409, "0 views", path=self.CAMERA)
        held = ((0.5, 0, (0, 0, 1.6)), (-0.5, 0.1, (-0.2, 0.1, 1.7)), (0.1, 0.5, (0.2, -0.1, 1.6)),
                (0.1, -0.5, (0.1, 0.15, 1.8)), (0.4, -0.4, (-0.15, -0.1, 1.5)))
        for number, pose in enumerate(held, start=1):
            self.call("postFrame", 202, self.CAMERA, None, board_png(*pose), {"Content-Type": "image/png"})
            told = wait_for(lambda: self.get("getIntrinsics", self.CAMERA), lambda p: p["frames"] == number, 60)
            self.assertTrue(told["newest"]["taken"], told["newest"])
            self.assertEqual(len(told["newest"]["corners_px"]), COLUMNS * ROWS)
            time.sleep(1.1)  # what changes within a second is a board that moves
        self.call("finishIntrinsics", 202, self.CAMERA)
        done = wait_for(lambda: self.get("getIntrinsics", self.CAMERA), lambda p: p["state"] != "fitting", 60)
        self.assertEqual(done["state"], "done", done["refusal"])
        result = done["result"]
        self.assertLess(abs(result["intrinsics"]["fx_px"] - FOCAL), 4 * result["sigmas"]["focal_px"][0] + 1)
        self.assertEqual(self.calibration()[0]["intrinsics_made"]["from"], BOARD)
        self.call("restoreCalibration", 200, self.CAMERA, body={})
        self.call("cancelIntrinsics", 204, self.CAMERA)
        self.problem("cancelIntrinsics", 404, "ceiling", path=self.CAMERA)
