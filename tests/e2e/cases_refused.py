"""What the command line refuses, and how."""
import os
import pathlib
import socket
import struct
import tempfile
import zlib

from cli import SCENARIO, Case, run

COMMANDS = ("serve", "track", "simulate", "evaluate", "reproduce", "calibrate")


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
