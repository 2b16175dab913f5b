"""What one command writes, another reads."""
import csv
import json
import math
import pathlib
import shutil

from cli import SCENARIO, Case, run


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
