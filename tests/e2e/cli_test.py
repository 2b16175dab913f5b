"""The command line from outside: cli_test.py <path of skylight>.

Each bad invocation must end by itself with its exit code (2: usage, 1: failed), say in words what is wrong
and where, and never crash. The good ones must fit together: what `simulate` writes, `track` reads back.
"""
import csv
import json
import math
import os
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

PROGRAM = None
COMMANDS = ("serve", "track", "simulate", "evaluate", "reproduce", "calibrate")

# One robot on a short arc under a small camera.
SCENARIO = {
    "seed": 3,
    "duration_s": 3,
    "room": {"size_m": [3, 2.4], "floor": {"material": "speckle"}},
    "cameras": [{"id": "ceiling", "position_m": [0, 0, 2.5], "width_px": 640, "height_px": 480, "fx_px": 500,
                 "fy_px": 500, "distortion": [0, 0, 0, 0, 0], "frame_rate_hz": 30, "depth": {"enabled": True}}],
    "robots": [{"id": "anna", "picture": {"seed": 5}, "start": {"x_m": -0.2, "y_m": 0.1, "yaw_deg": 30},
                "program": [{"do": "arc", "radius_m": 0.6, "angle_deg": 360, "speed_mps": 0.2}]}],
}


def run(*arguments, cwd=None, timeout=60):
    """Standard output, standard error and exit code of one run."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("SKYLIGHT_")}
    done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=cwd, env=environment, stdin=subprocess.DEVNULL,
                          capture_output=True, timeout=timeout)
    return done.stdout.decode(), done.stderr.decode(), done.returncode


def png(width, height, pixel, claimed=None):
    """A grey PNG; `claimed` is the size that its head states instead."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes(pixel(x, y) for x in range(width)) for y in range(height))
    head = struct.pack(">IIBBBBB", *(claimed or (width, height)), 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def checks(x, y):
    """Something to hold on to."""
    return 60 + 37 * ((x // 5 * 7 + y // 5 * 13) % 5)


class Case(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="skylight_cli_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)

    def write(self, name, content):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, (dict, list)):
            content = json.dumps(content, indent=1)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def refused(self, code, words, *arguments, **options):
        with self.subTest(arguments=" ".join(map(str, arguments))):
            out, err, returned = run(*arguments, cwd=self.folder, **options)
            self.assertEqual(returned, code, f"\nstdout: {out}\nstderr: {err}")
            self.assertTrue(err.strip(), "an empty message")
            for word in words:
                self.assertIn(word, err)
            self.assertNotIn("terminate called", err)


class Help(Case):
    def test_help_and_version_everywhere(self):
        for arguments in (("--help",), ("-h",), *((command, "--help") for command in COMMANDS)):
            out, err, code = run(*arguments)
            self.assertEqual(code, 0, arguments)
            self.assertIn("Usage: ", out)
            self.assertEqual(err, "")
        for command in COMMANDS:
            self.assertIn(command, run("--help")[0])
        for arguments in (("--version",), *((command, "--version") for command in COMMANDS)):
            out, err, code = run(*arguments)
            self.assertEqual((code, err), (0, ""), arguments)
            self.assertRegex(out, r"^skylight \d+\.\d+\.\d+\n$")


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
                (("intrinsics", lens.parent, "--board", "chess"), 2, "chessboard:9x6:0.025"),
                (("intrinsics", lens.parent / "none", "--board", "chessboard:9x6:0.02"), 1, "none"),
                (("extrinsics", "--camera", lens), 2, "names no picture"),
                (("extrinsics", "--camera", f"{lens}=none.png", "--tag", "36h11:1@0,0:0.2"), 2, "36h11:3@1.5,-0.5,90:0.2"),
                (("extrinsics", "--camera", lens, "--points", self.points("mirrored.csv", -1)), 1, "mirrored"),
                (("extrinsics", "--camera", lens, "--points", self.write("bad.csv", "u_px,v_px,x_m\n")), 1, "bad.csv:1"),
                (("map", lens, "--frame", "0,0,0"), 1, "extrinsics"),
                (("robot", lens.parent), 2, "--config"), (("robot", "--distance", "far"), 2, "--distance"),
                (("robot", "--distance", "0.01"), 2, "0.1 to 1000"), (("robot", "--robot", "nobody"), 2, "nobody"),
                (("restore", lens), 1, "no versions"), ((), 2, "subcommand")):
            out, err, got = run("calibrate", *arguments)
            self.assertEqual(got, code, (arguments, err))
            self.assertIn(words, err)
            self.assertEqual(out, "")


class Usage(Case):
    def test_what_the_parser_refuses(self):
        self.refused(2, ["command is needed", "--help"])
        self.refused(2, ["fly"], "fly")
        self.refused(2, ["--fast"], "serve", "--fast")
        self.refused(2, ["input"], "track")
        self.refused(2, ["scenario"], "simulate")
        self.refused(2, ["scenarios"], "evaluate")
        self.refused(2, ["--port", "http"], "serve", "--port", "http")
        self.refused(2, ["--duration", "-1"], "simulate", "straight", "--duration", "-1")
        self.refused(2, ["--format", "gif"], "simulate", "straight", "--format", "gif")
        self.refused(2, ["--duration", "soon"], "simulate", "straight", "--duration", "soon")
        self.refused(2, ["--seed"], "simulate", "straight", "--seed", "-4")
        self.refused(2, ["--kind", "predicted"], "track", "x.mp4", "--kind", "predicted")

    def test_reproduce(self):
        with tempfile.TemporaryDirectory() as folder:
            taken = pathlib.Path(folder, "taken")
            taken.write_text("a file")
            self.refused(2, ["--out", "taken"], "reproduce", "--out", taken)
            self.refused(2, ["--data", "nowhere", "mrclam6"], "reproduce", "--out", folder, "--data", "nowhere")
            self.refused(2, ["--seeds"], "reproduce", "--out", folder, "--seeds", "0")
            self.assertEqual(os.listdir(folder), ["taken"])

    def test_evaluate(self):
        self.refused(2, ["smoothed", "window", "measured, filtered, predicted"], "evaluate", "straight", "--kind",
                     "smoothed", "--filter", "window")
        self.refused(2, ["guessed"], "evaluate", "straight", "--kind", "guessed")
        self.refused(2, ["--horizon"], "evaluate", "straight", "--kind", "predicted")
        self.refused(2, ["--detector", "magic"], "evaluate", "straight", "--detector", "magic")
        self.refused(2, ["--filter", "kalman"], "evaluate", "straight", "--filter", "kalman")
        self.refused(2, ["demo", "duration_s", "--duration"], "evaluate", "demo")
        self.refused(2, ["--duration"], "evaluate", "straight", "--duration", "0")
        self.refused(2, ["--repeats"], "evaluate", "straight", "--repeats", "0")
        self.refused(2, ["tracker.audit_interval", "-1"], "evaluate", "straight", "--set", "tracker.audit_interval=-1")


class Configuration(Case):
    def serve(self, words, config, name="config.json"):
        self.refused(2, [name, *words], "serve", "--config", self.write(name, config))

    def test_files(self):
        self.refused(2, ["absent.json"], "serve", "--config", self.folder / "absent.json")
        self.refused(2, [str(self.folder)], "serve", "--config", self.folder)
        self.serve([":3:"], '{"server": {\n "port": 8080\n "host": "x"}}')
        self.serve(["serverr"], {"serverr": {}})
        self.serve(["server.prt"], {"server": {"prt": 1}})
        self.serve(["server.port", "eighty"], {"server": {"port": "eighty"}})
        self.serve(["server.port", "70000", "0 to 65535"], {"server": {"port": 70000}})
        self.serve(["server.port"], {"server": {"port": 80.5}})
        self.serve(["config.json:1", "prediction.horizon_s"], '{"prediction": {"horizon_s": NaN}}')
        self.serve(["robots[1].id", "anna"],
                   {"robots": [{"id": "anna"}, {"id": "anna"}]})
        self.serve(["source.type", "carrier pigeon"], {"source": {"type": "carrier pigeon"}})

    def test_flags(self):
        self.refused(2, ["--set server.port", "70000", "0 to 65535"], "serve", "--set", "server.port=70000")
        self.refused(2, ["--port", "70000"], "serve", "--port", "70000")
        self.refused(2, ["--set", "nonsense"], "serve", "--set", "nonsense")
        self.refused(2, ["server.prt"], "serve", "--set", "server.prt=1")

    def test_other_machines_need_a_token(self):
        for host in ("0.0.0.0", "192.168.1.5", "::"):
            self.refused(2, [host, "token_sha256"], "serve", "--host", host, "--port", "0")

    def test_the_pictures_and_videos_that_it_names(self):
        def with_image(image):
            return {"source": {"type": "folder", "path": "frames", "camera": "c"},
                    "cameras": [{"id": "c", "overhead": {"height_m": 2.5, "metres_per_pixel": 0.005,
                                                         "size_px": [64, 48]}}],
                    "appearances": [{"id": "a", "image": image, "metres_per_pixel": 0.002}],
                    "robots": [{"id": "r", "appearance": "a"}]}
        self.write("frames/1.png", png(64, 48, checks))
        self.write("flat.png", png(64, 64, lambda x, y: 90))
        self.write("tiny.png", png(4, 4, checks))
        self.write("huge.png", png(4, 4, checks, claimed=(60000, 60000)))
        self.write("text.png", "no picture")
        for image, words in {"flat.png": ["a", "colour"], "tiny.png": ["8"], "text.png": ["text.png"],
                             "huge.png": ["huge.png", "3600000000 pixels", "allowed"],
                             "absent.png": ["absent.png", "no such file"]}.items():
            self.refused(1, words, "serve", "--port", "0", "--config", self.write("c.json", with_image(image)))
        frames_absent = with_image("flat.png")
        frames_absent["source"]["path"] = "nowhere"
        self.refused(1, ["nowhere"], "serve", "--config", self.write("c.json", frames_absent))
        self.refused(1, ["nosuch.mp4"], "track", self.folder / "nosuch.mp4", "--config",
                     self.write("c.json", with_image("flat.png")))

    def test_a_port_in_use(self):
        scenario = self.write("room.json", SCENARIO)
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = taken.getsockname()[1]
            self.refused(1, [str(port), "in use"], "serve", "--scenario", scenario, "--port", port)


class Scenarios(Case):
    def test_unknown_or_wrong(self):
        for command in (("simulate",), ("evaluate",), ("serve", "--scenario")):
            self.refused(1, ["atlantis"], *command, "atlantis")
            self.refused(1, ["absent.json"], *command, self.folder / "absent.json")
            broken = self.write("broken.json", '{\n "seed": 1,\n "rooom": {}\n}\n')
            self.refused(2, ["broken.json:3", "rooom"], *command, broken)
            unread = self.write("unread.json", '{\n "seed": 1,,\n}\n')
            self.refused(2, ["unread.json:2"], *command, unread)
            far = dict(SCENARIO, room={"size_m": [900, 3]})
            self.refused(2, ["far.json", "room.size_m", "900"], *command, self.write("far.json", far))

    def test_a_scenario_that_never_ends_needs_a_duration(self):
        endless = {k: v for k, v in SCENARIO.items() if k != "duration_s"}
        self.refused(2, ["--duration"], "simulate", self.write("endless.json", endless), "--out", self.folder / "out")

    def test_places_that_cannot_be_written_to(self):
        scenario = self.write("room.json", SCENARIO)
        a_file = self.write("file", "x")
        self.refused(1, ["file"], "simulate", scenario, "--out", a_file)
        self.refused(1, ["file"], "simulate", scenario, "--out", a_file / "below")
        self.refused(1, ["cannot be written"], "evaluate", self.short(), "--json", self.folder / "absent" / "r.json")

    def short(self):
        return self.write("short.json", dict(SCENARIO, duration_s=0.1))


class Track(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.frames = cls.folder / "frames"
        cls.frames.mkdir()
        for i in range(3):
            (cls.frames / f"{i}.png").write_bytes(png(64, 48, checks))

    def cut(self, code, words, cut, *more):
        self.refused(code, words, "track", self.frames, "--metres-per-pixel", "0.005", "--cut", cut, *more)

    def test_cuts(self):
        for cut in ("r", "r:", "r:1,2,3", "r:1,2,3,4,5,6", "r:a,b,c,d", "10,10,20,20"):
            self.cut(2, ["--cut", cut, "LEFT,TOP,WIDTH,HEIGHT"], cut)
        self.cut(2, ["id"], ":10,10,20,20")
        self.cut(2, ["box_px"], "r:10,10,4,20")
        self.cut(2, ["box_px"], "r:nan,10,20,20")
        self.cut(2, ["box_px", "-5"], "r:-5,10,20,20")
        self.cut(1, ["box", "64"], "r:60,10,20,20")
        self.cut(1, ["box"], "r:1000,1000,20,20")
        self.refused(2, ["--metres-per-pixel"], "track", self.frames, "--cut", "r:10,10,20,20")
        self.refused(2, ["--metres-per-pixel"], "track", self.frames, "--cut", "r:10,10,20,20", "--metres-per-pixel", "0")
        self.refused(2, ["--config", "--cut"], "track", self.frames)

    def test_outputs(self):
        good = "r:10,10,20,20"
        self.cut(2, ["poses.xml", ".csv, .tum, .json, .mot"], good, "--out", self.folder / "poses.xml")
        self.cut(2, ["poses"], good, "--out", self.folder / "poses")
        self.cut(2, ["absent", "no such folder"], good, "--out", self.folder / "absent" / "p.csv")
        (self.folder / "taken.csv").mkdir()
        self.cut(2, ["taken.csv"], good, "--out", self.folder / "taken.csv")

    def test_inputs(self):
        def tracked(path):
            return "track", path, "--metres-per-pixel", "0.005", "--cut", "r:10,10,20,20"
        self.refused(1, ["absent.mp4", "no such file"], *tracked(self.folder / "absent.mp4"))
        self.refused(1, ["notes.mp4"], *tracked(self.write("notes.mp4", "no video")))
        self.refused(1, ["empty.mp4"], *tracked(self.write("empty.mp4", "")))
        # The head of an MP4 whose index, at its end, is missing.
        cut_off = struct.pack(">I", 24) + b"ftypisom\0\0\2\0isomiso2" + struct.pack(">I", 90000) + b"mdat" + b"\x17" * 5000
        self.refused(1, ["cut.mp4"], *tracked(self.write("cut.mp4", cut_off)))
        (self.folder / "none").mkdir()
        self.refused(1, ["none", "no pictures"], *tracked(self.folder / "none"))
        self.write("damaged/1.png", "no picture")
        self.refused(1, ["damaged", "not one picture"], *tracked(self.folder / "damaged"))
        self.refused(2, ["--frame-rate"], *tracked(self.folder / "absent.mp4"), "--frame-rate", "20")

    def test_frames_of_another_size_than_the_camera(self):
        config = {"source": {"type": "folder", "path": "frames", "camera": "c"},
                  "cameras": [{"id": "c", "overhead": {"height_m": 2.5, "metres_per_pixel": 0.005,
                                                       "size_px": [640, 480]}}],
                  "appearances": [{"id": "a", "image": "frames/0.png", "metres_per_pixel": 0.002}],
                  "robots": [{"id": "r", "appearance": "a"}]}
        self.refused(1, ["64 x 48", "640 x 480"], "track", self.frames, "--config", self.write("c.json", config))


class Together(Case):
    """simulate, track and evaluate over the same short scene."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scenario = cls.folder / "room.json"
        cls.scenario.write_text(json.dumps(SCENARIO))
        cls.out = cls.folder / "T"
        cls.simulated = run("simulate", cls.scenario, "--duration", "1.5", "--out", cls.out)

    def rows(self, path):
        with open(path, newline="") as file:
            return list(csv.DictReader(file))

    def track(self, name, *more):
        poses = self.folder / name
        out, err, code = run("track", self.out / "ceiling", "--config", self.out / "config.json", "--out", poses, *more)
        self.assertEqual(code, 0, err)
        return poses, out

    def test_simulate_writes_frames_depth_and_truth(self):
        out, err, code = self.simulated
        self.assertEqual(code, 0, err)
        self.assertIn("45 frames", out)
        self.assertEqual(len(list((self.out / "ceiling").glob("*.png"))), 45)
        self.assertEqual(len(list((self.out / "ceiling" / "depth").glob("*.png"))), 45)
        self.assertEqual(len(self.rows(self.out / "truth.csv")), 45)
        self.assertEqual(len((self.out / "truth.anna.tum").read_text().splitlines()), 45)

    def test_track_finds_what_simulate_wrote(self):
        poses, _ = self.track("measured.csv", "--kind", "measured")
        truth = {row["captured"]: row for row in self.rows(self.out / "truth.csv")}
        measured = self.rows(poses)
        self.assertGreater(len(measured), 30, "it has to be searched for at first")
        for row in measured:
            true = truth[row["captured"]]
            error = math.hypot(float(row["x"]) - float(true["x"]), float(row["y"]) - float(true["y"]))
            self.assertLess(error, 0.002, row)
            turn = math.remainder(float(row["yaw"]) - float(true["yaw"]), 2 * math.pi)
            self.assertLess(abs(turn), math.radians(1.0), row)

    def test_track_writes_the_same_poses_in_every_format(self):
        rows = self.rows(self.track("p.csv")[0])
        self.assertTrue(rows)
        tum = [list(map(float, line.split())) for line in self.track("p.tum")[0].read_text().splitlines()]
        points = json.loads(self.track("p.json")[0].read_text())["points"]
        self.assertEqual(len(rows), len(tum))
        self.assertEqual(len(rows), len(points))
        for row, line, point in zip(rows, tum, points):
            self.assertEqual(float(row["captured"]), line[0])
            self.assertAlmostEqual(float(row["captured"]), point["captured"], delta=1e-6, msg="JSON: microseconds")
            self.assertAlmostEqual(float(row["x"]), line[1], 9)
            self.assertAlmostEqual(float(row["y"]), point["y"], 9)
            self.assertAlmostEqual(float(row["yaw"]), 2 * math.atan2(line[6], line[7]), 8)

    def test_track_over_files_is_evaluate_in_lockstep(self):
        """PNG, depth and the configuration lose nothing: the same errors from the files as from memory."""
        short = self.folder / "short.json"
        short.write_text(json.dumps(dict(SCENARIO, duration_s=1.5)))
        report = self.folder / "report.json"
        out, err, code = run("evaluate", short, "--json", report)
        self.assertEqual(code, 0, err)
        self.assertIn("anna", out)
        kinds = {s["kind"]: s for s in json.loads(report.read_text())["scenarios"]}
        truth = {row["captured"]: row for row in self.rows(self.out / "truth.csv")}
        rows = self.rows(self.track("lockstep.csv", "--kind", "measured")[0])
        errors = [math.hypot(float(r["x"]) - float(truth[r["captured"]]["x"]),
                             float(r["y"]) - float(truth[r["captured"]]["y"])) for r in rows]
        scored = kinds["measured"]["robots"][0]["position_error_m"]
        # Scores begin 1 s after the robot came into view; these are the last of the frames.
        last = errors[-kinds["measured"]["robots"][0]["frames"]:]
        self.assertAlmostEqual(max(last), scored["max"], 7)
        self.assertAlmostEqual(min(last), scored["min"], 7)
        self.assertAlmostEqual(sum(last) / len(last), scored["mean"], 7)

    def test_track_writes_smoothed_poses_one_for_each_frame_since_the_robot_was_found(self):
        smoothed = self.rows(self.track("smoothed.csv", "--kind", "smoothed")[0])
        measured = self.rows(self.track("all.csv", "--kind", "measured")[0])
        self.assertEqual({row["kind"] for row in smoothed}, {"smoothed"})
        self.assertEqual([row["captured"] for row in smoothed], [row["captured"] for row in measured])
        truth = {row["captured"]: row for row in self.rows(self.out / "truth.csv")}
        for row in smoothed:
            true = truth[row["captured"]]
            error = math.hypot(float(row["x"]) - float(true["x"]), float(row["y"]) - float(true["y"]))
            self.assertLess(error, 0.003, row)
        window = ("--kind", "smoothed", "--set", 'tracker.filter={"type": "window"}')
        tracked = ("track", self.out / "ceiling", "--config", self.out / "config.json")
        self.refused(2, ["smoothed", "window", "anna"], *tracked, *window)
        self.refused(2, ["smoothed", ".mot"], *tracked, "--kind", "smoothed", "--out", self.folder / "s.mot")

    def test_evaluate_prints_what_the_design_lists(self):
        out, err, code = run("evaluate", self.scenario, "--json", "-", "--kind", "filtered,smoothed", "--set",
                             "tracker.filter.gate=20")
        self.assertEqual(code, 0, err)
        scenario, smoothed = json.loads(out)["scenarios"]
        self.assertEqual((smoothed["kind"], smoothed["filter"]), ("smoothed", "motion"))
        self.assertEqual(smoothed["robots"][0]["availability"], 1.0)
        self.assertEqual(smoothed["robots"][0]["frames"], scenario["robots"][0]["frames"])
        self.assertEqual((scenario["seed"], scenario["frame_rate"], scenario["frames"]), (3, 30.0, 90))
        self.assertEqual(scenario["kind"], "filtered")
        self.assertEqual({"mean", "p50", "p99"}, set(scenario["tracker_ms"]))
        (robot,) = scenario["robots"]
        self.assertLessEqual({"id", "frames", "availability", "position_error_m", "yaw_error_rad", "nees_mean",
                              "measured", "usable", "confident_wrong", "find", "hidden"}, set(robot))
        self.assertEqual({"mean", "std", "min", "p50", "p95", "p99", "max"}, set(robot["position_error_m"]))
        self.assertEqual({"mean", "p95", "p99", "max"}, set(robot["yaw_error_rad"]))
        self.assertEqual({"id_switches", "idf1", "mota"}, set(scenario["identity"]))
        self.assertEqual((robot["usable"], robot["confident_wrong"]), (1.0, 0))

    def test_a_video_without_loss_gives_the_same_poses_and_one_to_look_at_nearly(self):
        exact = self.track("png.csv", "--kind", "measured")[0].read_text()
        for name, tolerance in (("video", 0.0), ("mp4", 0.01)):
            out = self.folder / name
            _, err, code = run("simulate", self.scenario, "--duration", "1.5", "--format", name, "--out", out)
            self.assertEqual(code, 0, err)
            poses = self.folder / f"{name}.csv"
            _, err, code = run("track", out / "ceiling", "--config", out / "config.json", "--kind", "measured",
                               "--out", poses)
            self.assertEqual(code, 0, err)
            if not tolerance:
                self.assertEqual(poses.read_text(), exact)
                continue
            by_time = {row["captured"]: row for row in self.rows(self.folder / "png.csv")}
            for row in self.rows(poses):
                other = by_time[row["captured"]]
                apart = math.hypot(float(row["x"]) - float(other["x"]), float(row["y"]) - float(other["y"]))
                self.assertLess(apart, tolerance)

    def test_truth_and_results_go_to_outside_evaluators(self):
        results, _ = self.track("p.mot")
        lines = [line.split(",") for line in results.read_text().splitlines()]
        self.assertTrue(lines)
        truth = [line.split(",") for line in (self.out / "ceiling" / "mot" / "gt.txt").read_text().splitlines()]
        self.assertEqual({len(line) for line in truth}, {9})
        self.assertEqual({len(line) for line in lines}, {10})
        boxes = {line[0]: list(map(float, line[2:6])) for line in truth}
        self.assertEqual(truth[0][:2], ["1", "1"])
        for line in lines:
            left, top, width, height = map(float, line[2:6])
            around = boxes[line[0]]
            self.assertLess(abs(left + width / 2 - around[0] - around[2] / 2), around[2] / 2)
            self.assertLess(abs(top + height / 2 - around[1] - around[3] / 2), around[3] / 2)

    def test_the_schema_is_the_published_one(self):
        out, err, code = run("simulate", "--schema")
        self.assertEqual((code, err), (0, ""))
        published = pathlib.Path(__file__).resolve().parents[2] / "sim" / "scenario.schema.json"
        self.assertEqual(json.loads(out), json.loads(published.read_text()))

    def test_expectations_are_judged_on_all_repeats_of_each_variant(self):
        expecting = dict(SCENARIO, duration_s=1.3, repeats=2, sweep=[{"key": "light.level", "values": [1.0, 0.6]}],
                         expect=[{"figure": "max_error_m", "kind": "measured", "at_most": 0.005},
                                 {"figure": "mean_error_m", "kind": "measured", "robot": "anna", "at_most": 1e-9}])
        out, err, code = run("evaluate", self.write_json("expecting.json", expecting), "--kind", "filtered",
                             "--json", self.folder / "expecting.report.json")
        self.assertEqual(code, 1, err)
        self.assertIn("2 of 4 expectations failed", err)
        self.assertEqual(out.count("kept    max_error_m of anna (measured)"), 2, out)
        self.assertEqual(out.count("FAILED  mean_error_m of anna (measured)"), 2, out)
        self.assertIn("light.level=0.6, 2 seeds from 3 pooled", out)
        self.assertIn("worst with seed", out)
        report = json.loads((self.folder / "expecting.report.json").read_text())
        self.assertEqual([s["seed"] for s in report["scenarios"] if s["kind"] == "measured"], [3, 4, 3, 4])
        pooled = [s for s in report["pooled"] if s["kind"] == "measured"]
        self.assertEqual([s["seeds"] for s in pooled], [[3, 4], [3, 4]])
        self.assertEqual([e["kept"] for e in report["expectations"]], [True, False, True, False])
        self.assertEqual({"scenario", "figure", "robot", "kind", "at_most", "at_least", "value", "kept"},
                         set(report["expectations"][0]))
        alone = [s["robots"][0]["position_error_m"] for s in report["scenarios"] if s["kind"] == "measured"]
        both = pooled[0]["robots"][0]["position_error_m"]
        self.assertEqual(both["max"], max(alone[0]["max"], alone[1]["max"]))
        self.assertAlmostEqual(both["mean"], (alone[0]["mean"] + alone[1]["mean"]) / 2, 12)

    def test_repeats_and_duration_of_the_command_line_count(self):
        out, err, code = run("evaluate", self.scenario, "--repeats", "3", "--seed", "8", "--duration", "0.2",
                             "--json", "-", "--kind", "measured")
        self.assertEqual(code, 0, err)
        report = json.loads(out)
        self.assertEqual([(s["seed"], s["frames"]) for s in report["scenarios"]], [(8, 6), (9, 6), (10, 6)])
        self.assertEqual(report["expectations"], [])

    def test_copies_are_told_where_they_begin_and_all_found(self):
        twins = dict(SCENARIO, duration_s=1.6, robots=[dict(
            SCENARIO["robots"][0], start={"x_m": -0.5, "y_m": 0, "yaw_deg": 90}, copies={"count": 2, "spacing_m": [1, 0]})])
        out, err, code = run("evaluate", self.write_json("twins.json", twins), "--kind", "measured", "--json", "-")
        self.assertEqual(code, 0, err)
        (scored,) = json.loads(out)["scenarios"]
        self.assertEqual([r["measured"] for r in scored["robots"]], [1.0, 1.0])
        self.assertEqual(scored["identity"], {"id_switches": 0, "idf1": 1.0, "mota": 1.0})

    def write_json(self, name, content):
        path = self.folder / name
        path.write_text(json.dumps(content))
        return path

    def test_a_damaged_picture_is_skipped_and_counted(self):
        copy = self.folder / "copy"
        shutil.copytree(self.out, copy)
        (copy / "ceiling" / "000020.png").write_bytes(b"damaged")
        out, err, code = run("track", copy / "ceiling", "--config", copy / "config.json")
        self.assertEqual(code, 0, err)
        self.assertIn("44 frames, 1 skipped", out)

    def test_a_seed_fixes_everything(self):
        again = self.folder / "again"
        run("simulate", self.scenario, "--duration", "0.1", "--out", again, "--seed", "3")
        other = self.folder / "other"
        run("simulate", self.scenario, "--duration", "0.1", "--out", other, "--seed", "4")
        first = (self.out / "ceiling" / "000002.png").read_bytes()
        self.assertEqual(first, (again / "ceiling" / "000002.png").read_bytes())
        self.assertNotEqual(first, (other / "ceiling" / "000002.png").read_bytes())


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: cli_test.py <path of skylight> [unittest's own arguments]")
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main(verbosity=1)
