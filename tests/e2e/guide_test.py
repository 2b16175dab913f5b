#!/usr/bin/env python3
"""deploy/own-camera.md, followed: what it says to write is written, what it says to run is run, in its order, and what
it promises is judged against the simulator's truth.

    guide_test.py SKYLIGHT BOARD_FILM
"""
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
GUIDE = ROOT / "deploy" / "own-camera.md"
LAST = "## How high is it, exactly?"  # a robot's geometry has its own tests
SKYLIGHT, BOARD_FILM = None, None


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def blocks(text):
    """The indented blocks, each without its indentation."""
    found = re.findall(r"(?:^    .*\n(?:\n(?=    ))?)+", text, re.M)
    return [re.sub(r"^    ", "", block, flags=re.M).strip() + "\n" for block in found]


class Guide(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="skylight_guide_"))
        cls.running = {}
        cls.port, cls.camera_port = free_port(), free_port()

    @classmethod
    def tearDownClass(cls):
        for name in list(cls.running):
            cls.stop(name)
        for log in sorted(cls.folder.glob("*.log")):
            print(f"--- {log.name}\n{log.read_text(errors='replace')}")
        shutil.rmtree(cls.folder, ignore_errors=True)

    @classmethod
    def stop(cls, name):
        process = cls.running.pop(name, None)
        if process is None:
            return
        os.killpg(process.pid, signal.SIGINT if name == "camera" else signal.SIGTERM)
        process.wait(30)
        process.stdout.close()

    def start(self, name, command):
        """Runs on until something of the same name is started; returns once it has printed its first line."""
        self.stop(name)
        with open(self.folder / f"{name}.log", "ab") as log:
            process = subprocess.Popen(command, shell=True, cwd=self.folder, stdout=subprocess.PIPE, stderr=log,
                                       start_new_session=True)
        self.running[name] = process
        self.assertTrue(process.stdout.readline(), f"{command} ended without a word")

    def run_block(self, block):
        here = (block.replace("127.0.0.1:8080", f"127.0.0.1:{self.port}").replace(":8554", f":{self.camera_port}")
                .replace("--port 8554", f"--port {self.camera_port}").replace("build/release/skylight", SKYLIGHT)
                .replace("build/release/board_film", BOARD_FILM)
                .replace("tests/support/", f"{ROOT}/tests/support/"))
        if '"type": "cameras"' in here:
            (self.folder / "my.json").write_text(here)
        elif here.startswith('{ "tags"'):
            (self.folder / "tags.json").write_text(here)
        elif here.startswith('"appearances"'):
            path = self.folder / "my.json"
            path.write_text(path.read_text().rstrip().removesuffix("}").rstrip() + ",\n" + here + "}\n")
        else:
            for command in re.sub(r"(\\|\|)\n\s*", r"\1 ", here).replace("\\ ", "").splitlines():
                self.run_command(command.split("   #")[0])

    def run_command(self, command):
        if command.startswith(("./deploy/run", "deploy/setup")):
            return  # whoever runs this has built already
        if "rtsp_server.py" in command:
            self.start("camera", "exec " + command)
        elif " serve " in command:
            self.start("service", f"exec {command} --port {self.port}")
            self.until("the camera runs", lambda: self.get("cameras/ceiling")["source"]["state"] == "running")
        else:
            done = subprocess.run(command, shell=True, cwd=self.folder, capture_output=True, timeout=300)
            self.assertEqual(done.returncode, 0, f"{command}\n{done.stderr.decode()}")
            self.said = done.stdout.decode()

    def get(self, path):
        said = subprocess.run(["curl", "-s", f"http://127.0.0.1:{self.port}/api/v1/{path}"], capture_output=True,
                              timeout=60).stdout
        return json.loads(said)

    def until(self, what, holds, within=120):
        end = time.monotonic() + within
        while not holds():
            self.assertLess(time.monotonic(), end, f"not within {within} s: {what}")
            time.sleep(0.5)

    def test_it_leads_from_a_camera_to_a_pose(self):
        text = GUIDE.read_text().split(LAST)[0]
        for title, section in re.findall(r"^## \d\. (.*)\n((?:(?!^## ).*\n)*)", text, re.M):
            with self.subTest(section=title):
                for block in blocks(section):
                    self.run_block(block)
                    self.judge(block)

    def judge(self, block):
        lens = "cameras/ceiling/calibration/intrinsics"
        if "/intrinsics |" in block:
            self.assertRegex(self.said, r"^\d+ views")
            self.until("ten views of the board", lambda: len(self.get(lens)["views"]) >= 10)
        elif "/intrinsics/finish" in block:
            self.until("the lens is known", lambda: self.get(lens)["state"] == "done")
            result = self.get(lens)["result"]
            self.assertLess(result["rms_px"], 0.3)
            self.assertAlmostEqual(result["intrinsics"]["fx_px"], 700.0, delta=1.5)
        elif "room/ceiling/video.mp4" in block:
            self.until("the camera is back", lambda: self.get("cameras/ceiling")["source"]["reconnects"] >= 1
                       and self.get("cameras/ceiling")["source"]["state"] == "running")
            time.sleep(2)  # until its newest frame is of the room
        elif "/extrinsics" in block:
            camera = json.loads(self.said)
            where = camera["cameras"][0] if "cameras" in camera else camera
            for got, true in zip(where["map_from_camera"]["position_m"], (0.0, 0.0, 4.0)):
                self.assertAlmostEqual(got, true, delta=0.005)
        elif "/robots/cleo/pose" in block:
            self.until("cleo is tracked", lambda: self.get("robots/cleo/pose")["state"] == "tracking")
            self.until("it drives along its line", lambda: self.on_its_line(self.get("robots/cleo/pose")["pose"]))

    @staticmethod
    def on_its_line(pose):
        return pose is not None and abs(pose["y"] + 2.4) < 0.004 and -2.45 < pose["x"] < -0.25


if __name__ == "__main__":
    SKYLIGHT, BOARD_FILM = map(os.path.abspath, sys.argv[1:3])
    if shutil.which("ffmpeg") is None:
        print("skipped: no ffmpeg")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1], verbosity=2)
