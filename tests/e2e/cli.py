"""The program from outside: runs it, and what its cases share."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

PROGRAM = None  # set before the first run

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
