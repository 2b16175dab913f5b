"""Calibrations from files."""
import json
import math

from cli import Case, run


class Calibrate(Case):
    """Clicked points, a lens that is known, and a camera 3 m above the floor that looks straight down."""
    LENS = {"format": 1, "intrinsics": {"width_px": 640, "height_px": 480, "fx_px": 400, "fy_px": 400, "cx_px": 320,
                                        "cy_px": 240}, "sigmas": {"focal_px": [0.2, 0.2]}}

    def points(self, name, flip=1):
        rows = ["u_px,v_px,x_m,y_m,name"]
        for x in (-2, -0.5, 1.5):
            for y in (-1.5, 0.25, 1):
                rows.append(f"{320 + 400 * x / 3},{240 - 400 * y / 3},{x},{flip * y},p{len(rows)}")
        return self.write(name, "\n".join(rows) + "\n")

    def test_points_say_where_the_camera_hangs_and_the_old_file_is_kept(self):
        lens = self.write(self._testMethodName + ".json", self.LENS)
        out, err, code = run("calibrate", "extrinsics", "--camera", lens, "--points", self.points("points.csv"), "--json")
        self.assertEqual(code, 0, err)
        self.assertLess(json.loads(out)["cameras"][0]["worst_floor_sigma_m"], 0.1)
        position = json.loads(lens.read_text())["map_from_camera"]["position_m"]
        for value, truth in zip(position, (0, 0, 3)):
            self.assertAlmostEqual(value, truth, delta=1e-3)
        self.assertIn("1\t", run("calibrate", "restore", lens, "--list")[0])
        self.assertEqual(run("calibrate", "map", lens, "--frame", "1,0,90")[2], 0)
        self.assertAlmostEqual(json.loads(lens.read_text())["map_from_camera"]["position_m"][1], 1, delta=1e-3)
        self.assertEqual(run("calibrate", "restore", lens, "--version", 1)[2], 0)
        self.assertNotIn("map_from_camera", json.loads(lens.read_text()))
        # One that somebody spoilt is told of, and in nobody's way.
        lens.with_suffix(".2.json").write_text("{}")
        out, err, code = run("calibrate", "restore", lens, "--list")
        self.assertEqual((err, code), ("", 0))
        self.assertRegex(out, r"(?m)^2\t.*is no calibration: .*format")
        self.assertEqual(run("calibrate", "extrinsics", "--camera", lens, "--points", self.points("p.csv"))[2], 0)

    # OpenCV's dictionary 4x4_50, row by row from the top left, 1 is white.
    MARKERS = {0: "1011010100110010", 1: "0000111110011010", 2: "0011001100101101", 3: "1001100101000110"}

    def photograph(self, name, prints):
        """What that camera sees of prints on a grey floor: (cells, cell_m, x_m, y_m, yaw_deg) each, cells row by row
        from the top, True for white, their middle at the place."""
        scale, light = 400 / 3, bytearray([110]) * (640 * 480)
        for cells, cell, x, y, yaw in prints:
            rows, columns = len(cells), len(cells[0])
            c, s = math.cos(math.radians(yaw)), math.sin(math.radians(yaw))
            reach = int(scale * cell * math.hypot(rows, columns) / 2) + 2
            u0, v0 = int(320 + scale * x), int(240 - scale * y)
            for v in range(max(0, v0 - reach), min(480, v0 + reach + 1)):
                for u in range(max(0, u0 - reach), min(640, u0 + reach + 1)):
                    total = 0
                    for k in range(4):
                        east = (u + k % 2 / 2 - 0.25 - 320) / scale - x
                        north = (240 - v - k // 2 / 2 + 0.25) / scale - y
                        column = math.floor((c * east + s * north) / cell + columns / 2)
                        row = math.floor(rows / 2 - (c * north - s * east) / cell)
                        inside = 0 <= row < rows and 0 <= column < columns
                        total += (220 if cells[row][column] else 20) if inside else 110
                    if total != 4 * 110:
                        light[640 * v + u] = total // 4
        return self.write(name, b"P5 640 480 255\n" + bytes(light))

    def marker(self, number, size, x, y, yaw):
        bits = self.MARKERS[number]
        cells = [[True] * 8] + [[True] + [False] * 6 + [True] for _ in range(6)] + [[True] * 8]
        for i, bit in enumerate(bits):
            cells[2 + i // 4][2 + i % 4] = bit == "1"
        return cells, size / 6, x, y, yaw

    def assert_hangs(self, lens, truth, delta):
        position = json.loads(lens.read_text())["map_from_camera"]["position_m"]
        for value, true in zip(position, truth):
            self.assertAlmostEqual(value, true, delta=delta)

    def test_sheets_of_tags_say_where_the_camera_hangs(self):
        lens = self.write(self._testMethodName + ".json", self.LENS)
        tags = {0: (-1.6, 1.0, 20), 1: (1.7, 1.1, 0), 2: (1.5, -1.2, -70)}
        # The fourth lies on a sheet that nobody measured.
        seen = [self.marker(i, 0.4, *place) for i, place in tags.items()] + [self.marker(3, 0.4, -1.4, -0.9, 45)]
        picture = self.photograph("floor.pgm", seen)
        listed = [{"family": "4x4_50", "id": i, "x_m": x - 0.5, "y_m": y, "yaw_deg": yaw, "size_m": 0.4}
                  for i, (x, y, yaw) in tags.items()]
        sheets = {"sheets": [{"name": "floor", "place": {"x_m": 0.5, "y_m": 0, "sigma_m": 0.001}, "tags": listed},
                             {"name": "loose", "tags": [{"family": "4x4_50", "id": 3, "x_m": 0, "y_m": 0,
                                                         "size_m": 0.4}]}]}
        file = self.write("sheets.json", sheets)
        out, err, code = run("calibrate", "extrinsics", "--camera", f"{lens}={picture}", "--tags", file, "--json")
        self.assertEqual(code, 0, err)
        made = json.loads(out)["cameras"][0]["extrinsics_made"]
        self.assertEqual([source["used"] for source in made["sources"]], [True] * 16)
        self.assertLess(made["rms_px"], 0.3)
        self.assert_hangs(lens, (0, 0, 3), 0.02)

        sheets["sheets"][0]["tags"][1]["size"] = 0.4
        self.refused(2, ["sheets.json", "sheets[0].tags[1].size"], "calibrate", "extrinsics", "--camera",
                     f"{lens}={picture}", "--tags", self.write("sheets.json", sheets))
        del sheets["sheets"][0]["tags"][1]["size"]
        sheets["sheets"][1]["tags"][0]["id"] = 0
        self.refused(2, ["4x4_50:0", "named twice"], "calibrate", "extrinsics", "--camera", f"{lens}={picture}",
                     "--tags", self.write("sheets.json", sheets))

    def test_a_board_on_the_floor_says_where_the_camera_hangs(self):
        lens = self.write(self._testMethodName + ".json", self.LENS)
        # 7 x 6 inner corners with a white rim, dark at the bottom left.
        cells = [[not (0 < r < 8 and 0 < c < 9 and (7 - r + c - 1) % 2 == 0) for c in range(10)] for r in range(9)]
        picture = self.photograph("board.pgm", [(cells, 0.25, 0.3, -0.2, 30)])
        board = ("--board", "chessboard:7x6:0.25")
        camera = ("calibrate", "extrinsics", "--camera", f"{lens}={picture}")
        self.refused(2, ["--board-at"], *camera, *board)
        self.refused(2, ["--board-at", "X,Y,YAW"], *camera, *board, "--board-at", "0.3,-0.2")
        self.refused(2, ["half a turn", "odd"], *camera, "--board", "chessboard:7x5:0.25", "--board-at", "0,0,0")
        self.refused(1, ["chessboard:9x6:0.25", "not found"], *camera, "--board", "chessboard:9x6:0.25", "--board-at",
                     "0,0,0")
        out, err, code = run(*camera, *board, "--board-at", "0.3,-0.2,30")
        self.assertEqual(code, 0, err)
        self.assertIn("board, corner 42", out)
        self.assert_hangs(lens, (0, 0, 3), 0.03)
        # Where it is said to lie is where the map is.
        self.assertEqual(run(*camera, *board, "--board-at", "1.3,-0.2,30")[2], 0)
        self.assert_hangs(lens, (1, 0, 3), 0.03)

    def test_bad_input_is_named(self):
        lens = self.write(self._testMethodName + ".json", self.LENS)
        for arguments, code, words in (
                (("intrinsics", lens.parent), 2, "--board"),
                (("intrinsics", "--board", "chessboard:9x6:0.02"), 2, "which pictures"),
                (("intrinsics", "--board", "chessboard:9x6:0.02", "--set", "source.type=cameras", "--set",
                  'cameras=[{"id": "hall", "intrinsics": {"width_px": 640, "height_px": 480, "fx_px": 400, "fy_px": 400,'
                  ' "cx_px": 320, "cy_px": 240}, "overhead": {"height_m": 3}, "source": {"type": "posted"}}]'), 2,
                 "camera 'hall' is posted to a running service"),
                (("intrinsics", "--board", "chessboard:9x6:0.02", "--set", "source.type=simulator"), 2,
                 "no live camera"),
                (("intrinsics", lens.parent, "--board", "chess"), 2, "chessboard:9x6:0.025"),
                (("intrinsics", lens.parent / "none", "--board", "chessboard:9x6:0.02"), 1, "none"),
                (("extrinsics", "--camera", lens), 2, "names no picture"),
                (("extrinsics", "--camera", f"{lens}=none.png", "--tag", "36h11:1@0,0:0.2"), 2, "36h11:3@1.5,-0.5,90:0.2"),
                (("extrinsics", "--camera", lens, "--points", self.points("mirrored.csv", -1)), 1, "mirrored"),
                (("extrinsics", "--camera", lens, "--points", self.write("bad.csv", "u_px,v_px,x_m\n")), 1, "bad.csv:1"),
                (("extrinsics", "--camera", f"{lens}=none.png", "--tag", "36h11:1e10@0,0,0:0.2"), 2, "0 to 100000"),
                (("extrinsics", "--camera", f"{lens}=none.png", "--tag", "36h11:1.5@0,0,0:0.2"), 2, "0 to 100000"),
                (("map", lens, "--frame", "0,0,0"), 1, "extrinsics"),
                (("robot", lens.parent), 2, "--config"), (("robot", "--distance", "far"), 2, "--distance"),
                (("robot", "--distance", "0.01"), 2, "0.1 to 1000"),
                (("robot", "--distance", "4:2"), 2, "0.00001 to 1"),
                (("robot", "--odometry-sigma", 0.9), 2, "--odometry-sigma"), (("robot", "--robot", "nobody"), 2, "nobody"),
                (("restore", lens), 1, "no versions"), ((), 2, "subcommand")):
            out, err, got = run("calibrate", *arguments)
            self.assertEqual(got, code, (arguments, err))
            self.assertIn(words, err)
            self.assertEqual(out, "")
