"""The Python package: logs, bus, drives, maps, and a stage in Python among real processes.

test_package.py BUILD    run by ctest with the package of that build and its programs
"""

import keyword
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import unittest

BUILD = pathlib.Path(sys.argv.pop(1) if len(sys.argv) > 1 else "build/release").resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(BUILD / "python"))

import numpy as np  # noqa: E402  (the package's place must be known before)

import understory  # noqa: E402
from understory import bus, drive, log, maps, messages  # noqa: E402

# Words that are no names in the languages of lcm-gen, and in Go.
WORDS_OF = {
    "Python": set(keyword.kwlist),
    "Lua": set("and break do else elseif end false for function goto if in local nil not or repeat return then true until while".split()),
    "Go": set("break case chan const continue default defer else fallthrough for func go goto if import interface map package range return select struct switch type var".split()),
    "Java": set(
        "abstract assert boolean break byte case catch char class const continue default do double else enum extends final"
        " finally float for goto if implements import instanceof int interface long native new package private protected"
        " public return short static strictfp super switch synchronized this throw throws transient try void volatile while".split()
    ),
    "C#": set(
        "abstract as base bool break byte case catch char checked class const continue decimal default delegate do double"
        " else enum event explicit extern false finally fixed float for foreach goto if implicit in int interface internal"
        " is lock long namespace new null object operator out override params private protected public readonly ref return"
        " sbyte sealed short sizeof stackalloc static string struct switch this throw true try typeof uint ulong unchecked"
        " unsafe ushort using virtual void volatile while".split()
    ),
    "C": set(
        "auto break case char const continue default do double else enum extern float for goto if inline int long register"
        " restrict return short signed sizeof static struct switch typedef union unsigned void volatile while".split()
    ),
}
URL = "udpm://239.255.76.{}:{}?ttl=0"


def url_of(test):
    """A group of its own for each test."""
    number = sum(map(ord, test)) % 200
    return URL.format(20 + number // 2 * 2 % 200, 27000 + 2 * number)


def pose(utime, x):
    one = understory.ground_truth_t()
    one.utime, one.world_T_vehicle.x = utime, x
    return one


class Types(unittest.TestCase):
    def test_no_field_is_a_word_of_a_language(self):
        fields = 0
        for file in sorted((ROOT / "lcmtypes").glob("*.lcm")):
            text = re.sub(r"//.*", "", file.read_text())
            for name in re.findall(r"^\s*\w+\s+(\w+)(?:\[[^\]]*\])*\s*;", text, re.MULTILINE):
                fields += 1
                for language, words in WORDS_OF.items():
                    self.assertNotIn(name, words, f"{file.name}: a word of {language}")
        self.assertGreater(fields, 300)

    def test_every_type_makes_a_round_trip(self):
        names = [file.stem for file in (ROOT / "lcmtypes").glob("*.lcm")]
        self.assertGreater(len(names), 50)
        for name in names:
            with self.subTest(name):
                data = getattr(understory, name)().encode()
                again = messages.decode(data)
                self.assertEqual(type(again).__name__, name)
                self.assertEqual(again.encode(), data)

    @unittest.skipUnless(shutil.which("gcc"), "no C compiler")
    def test_every_type_compiles_as_c(self):
        with tempfile.TemporaryDirectory() as folder:
            types = [str(file) for file in (ROOT / "lcmtypes").glob("*.lcm")]
            subprocess.run(["lcm-gen", "--c", "--c-cpath", folder, "--c-hpath", folder, *types], check=True)
            sources = sorted(str(file) for file in pathlib.Path(folder).glob("*.c"))
            self.assertEqual(len(sources), len(types))
            subprocess.run(["gcc", "-fsyntax-only", "-I", folder, *sources], check=True)


class Logs(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.file = pathlib.Path(self.folder.name) / "some.lcm"
        with log.LogWriter(self.file) as writer:
            for k in range(200):
                writer.write(10 * k, "GROUND_TRUTH" if k % 2 else "OTHER", pose(k, 0.5 * k) if k % 2 else bytes([k % 7] * k))

    def tearDown(self):
        self.folder.cleanup()

    def test_what_was_written_is_read(self):
        events = list(log.read(self.file))
        self.assertEqual([event.number for event in events], list(range(200)))
        self.assertEqual(events[7].message.world_T_vehicle.x, 3.5)
        self.assertIsNone(events[6].message)
        self.assertEqual(len(list(log.read(self.file, ["GROUND_.*"]))), 100)

    def test_the_command_reads_it(self):
        told = subprocess.run([BUILD / "bin/understory", "log", "info", self.file], capture_output=True, text=True, check=True)
        self.assertIn("GROUND_TRUTH", told.stdout)

    def test_damage_loses_what_it_hits_and_no_more(self):
        whole = self.file.read_bytes()
        originals = {event.number: event for event in log.read(self.file)}
        for seed in range(200):
            draw = random.Random(seed)
            data = bytearray(whole)
            at = draw.randrange(len(data) - 40)
            data[at : at + 40] = draw.randbytes(40)
            self.file.write_bytes(data[: draw.randrange(at + 40, len(data) + 1)] if seed % 2 else data)
            reader = log.Log(self.file)
            try:
                events = list(reader)
            except log.LogError as error:
                self.assertIn("some.lcm", str(error))
                continue
            intact = sum(event == originals.get(event.number) for event in events)
            with self.subTest(seed):
                self.assertLessEqual(len(events) - intact, 3)
                if seed % 2 == 0:
                    self.assertGreaterEqual(intact, 200 - 45)  # The shortest events have 40 bytes.

    def test_what_is_no_log_is_named(self):
        for text in (b"x" * 1000, b"\xed\xa1"):
            self.file.write_bytes(text)
            with self.assertRaisesRegex(log.LogError, "some.lcm: no LCM log"):
                list(log.read(self.file))
        with self.assertRaisesRegex(log.LogError, "nowhere.lcm"):
            list(log.read(self.file.with_name("nowhere.lcm")))


class LiveBus(unittest.TestCase):
    def test_small_and_large_messages_arrive_in_order(self):
        url = url_of("small")
        heard = []
        receiver = bus.Bus(url)
        receiver.subscribe("GROUND_TRUTH", lambda channel, message: heard.append(message.utime))
        receiver.subscribe("RAW_SWEEP|BYTES", lambda channel, data: heard.append((channel, data)))
        sender = bus.Bus(url)
        large = random.Random(1).randbytes(300_000)
        for k in range(5):
            sender.publish("GROUND_TRUTH", pose(k, 0.0))
        sender.publish("BYTES", large)
        sender.publish("BYTES", b"")
        receiver.run(for_s=1.0)
        sender.publish("RAW_SWEEP", large[:70_000])
        receiver.run(for_s=0.5)
        self.assertEqual(heard, [0, 1, 2, 3, 4, ("BYTES", large), ("BYTES", b""), ("RAW_SWEEP", large[:70_000])])
        self.assertEqual(receiver.damaged, 0)
        sender.close(), receiver.close()

    def test_damaged_messages_are_counted(self):
        url = url_of("damaged")
        receiver, sender = bus.Bus(url), bus.Bus(url)
        receiver.subscribe("GROUND_TRUTH", self.fail)
        sender.publish("GROUND_TRUTH", pose(1, 2.0).encode()[:-3])
        receiver.run(for_s=0.5)
        self.assertEqual(receiver.damaged, 1)
        sender.close(), receiver.close()

    def test_another_url_is_refused(self):
        for url in ("tcpq://localhost:7700", "udpm://239.255.76.67", "nonsense", "udpm://localhost:7667", "udpm://10.0.0.1:7667",
                    "udpm://[::1]:7667", "udpm://239.255.76.67:7667?ttl=x", "udpm://239.255.76.67:7667?ttl=300"):
            with self.assertRaisesRegex(ValueError, re.escape(url)):
                bus.Bus(url)

    def test_a_stage_in_python_takes_its_place(self):
        url = url_of("stage")
        poses = []
        listener = bus.Bus(url)
        listener.subscribe("SLAM_POSE", lambda channel, message: poses.append(message))
        program = ROOT / "examples/python_keyframer/keyframer.py"
        environment = {"PYTHONPATH": str(BUILD / "python"), "PATH": "/usr/bin:/bin", "HOME": tempfile.gettempdir()}
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        settings = pathlib.Path(folder.name) / "geoslam_mapper.toml"
        settings.write_text("[smoothing]\nmin_observations = 1\n")  # Keyframes of one scan.
        mapper = subprocess.Popen([BUILD / "bin/understory-geoslam-mapper", "--config", settings, "--lcm-url", url], stderr=subprocess.DEVNULL)
        stage = subprocess.Popen([sys.executable, program, url], env=environment)
        try:
            time.sleep(2.0)
            simulator = subprocess.Popen(
                [BUILD / "bin/understory", "sim", "intermediate", "--path", "line", "--length", "20", "--speed", "2", "--lcm-url", url],
                stdout=subprocess.DEVNULL,
            )
            listening = threading.Thread(target=listener.run, args=(14.0,))
            listening.start()
            self.assertEqual(simulator.wait(timeout=60), 0)
            listening.join()
            self.assertIsNone(stage.poll(), "the stage has ended")
        finally:
            for process in (stage, mapper):
                process.terminate()
                process.wait(timeout=10)
            listener.close()
        placed = [one for one in poses if drive.STATUS[one.status] in ("FIRST_MAP", "UPDATED", "TRACKED")]
        self.assertGreater(len(placed), 50)
        self.assertAlmostEqual(np.hypot(placed[-1].map_T_submap.x + placed[-1].submap_T_vehicle.x,
                                        placed[-1].map_T_submap.y + placed[-1].submap_T_vehicle.y), 20.0, delta=2.0)


class Results(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.folder.name)
        command = str(BUILD / "bin/understory")
        subprocess.run([command, "sim", "intermediate", "--path", "circle", "--length", "60", "--out", folder / "drive.lcm"],
                       check=True, capture_output=True)
        subprocess.run([command, "replay", folder / "drive.lcm", "--config", ROOT / "deploy/config", "--out", folder / "run.lcm"],
                       check=True, capture_output=True)
        subprocess.run([command, "export", folder / "run.lcm", "--out", folder / "out"], check=True, capture_output=True)
        subprocess.run([command, "map", "import", folder / "run.lcm", "--out", folder / "map.gpkg"], check=True, capture_output=True)
        cls.results, cls.files = drive.Drive(folder / "run.lcm"), folder

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_poses_are_those_that_export_writes(self):
        exported = np.loadtxt(self.files / "out/live.tum")
        poses = self.results.poses()
        self.assertEqual(len(poses), len(exported))
        np.testing.assert_allclose(np.column_stack([poses["t_s"], poses["x_m"], poses["y_m"]]), exported[:, :3], atol=1e-5)

    def test_errors_are_those_of_the_command(self):
        told = subprocess.run([BUILD / "bin/understory", "log", "accuracy", self.files / "run.lcm"], capture_output=True, text=True, check=True)
        rms_m = float(re.search(r"^ATE.*?live poses\s+([\d.]+)", told.stdout, re.MULTILINE | re.DOTALL).group(1))
        errors = drive.errors_m(self.results.poses(), self.results.truth())
        self.assertAlmostEqual(np.sqrt(np.nanmean(errors**2)), rms_m, delta=0.02 * rms_m + 0.001)

    def test_errors_are_what_poses_state(self):
        poses, truth = self.results.poses(), self.results.truth()
        errors = drive.errors_m(poses, truth, hold_first=True)
        sigma_m = np.sqrt(np.trace(poses["covariance"][:, :2, :2], axis1=1, axis2=2))
        self.assertLess(errors[0], 1e-9)
        self.assertTrue(np.isnan(drive.errors_m(poses, truth[:0])).all())
        self.assertGreater(np.mean(errors < 3 * sigma_m + 0.02), 0.8)

    def test_the_map_is_that_of_the_file(self):
        stored, told = maps.landmarks(self.files / "map.gpkg"), self.results.landmarks()
        self.assertEqual(maps.map_ids(self.files / "map.gpkg"), [1])
        self.assertEqual(len(stored), len(told))
        for column in ("id", "x_m", "y_m", "times_seen"):
            np.testing.assert_array_equal(stored[column], told[column])
        np.testing.assert_allclose(stored["covariance_m2"], told["covariance_m2"], rtol=1e-12)
        np.testing.assert_array_equal(maps.trajectory(self.files / "map.gpkg", 1)["x_m"], self.results.keyframes()["x_m"])

    def test_what_is_no_map_is_named(self):
        with self.assertRaisesRegex(maps.MapError, "run.lcm"):
            maps.landmarks(self.files / "run.lcm")

    def test_no_input_is_overwritten(self):
        command, run = str(BUILD / "bin/understory"), self.files / "run.lcm"
        before = run.read_bytes()
        link = self.files / "link.lcm"
        link.symlink_to(run)
        for words in (["report", run, "--out", run], ["report", link, "--out", run], ["replay", run, "--out", link],
                      ["import", "bag", run, "--out", run], ["import", "pcap", link, "--out", run]):
            with self.subTest(words[0]):
                refused = subprocess.run([command, *words], capture_output=True, text=True)
                self.assertEqual(refused.returncode, 2)
                self.assertIn("is the input itself", refused.stderr)
        self.assertEqual(run.read_bytes(), before)

    def test_a_survey_in_world_coordinates_is_moved_to_an_origin(self):
        table = self.files / "utm.csv"
        table.write_text("Easting;Northing\n401234,567;5654321,001\n401239,102;5654318,470\n")
        command = str(BUILD / "bin/understory")
        far = subprocess.run([command, "map", "import", table, "--out", self.files / "far.gpkg"], capture_output=True, text=True, check=True)
        self.assertIn("nothing is located farther than 2,000 km", far.stderr)
        np.testing.assert_array_equal(maps.landmarks(self.files / "far.gpkg")["y_m"], [5654321.001, 5654318.470])
        near = subprocess.run([command, "map", "import", table, "--origin", "401000,5654000", "--out", self.files / "near.gpkg"],
                              capture_output=True, text=True, check=True)
        self.assertEqual(near.stderr, "")
        np.testing.assert_allclose(maps.landmarks(self.files / "near.gpkg")["x_m"], [234.567, 239.102], atol=1e-6)

    def test_the_report_is_one_file(self):
        made = subprocess.run([BUILD / "bin/understory", "report", self.files / "run.lcm"], capture_output=True, text=True, check=True)
        text = (self.files / "run.html").read_text()
        self.assertEqual(made.stdout.strip(), str(self.files / "run.html"))
        for part in ("poses TRACKED", "ATE", "a replay writes none", "data:image/png;base64,", "SLAM_POSE"):
            self.assertIn(part, text)
        self.assertNotIn("<script", text)
        self.assertNotIn("http", text)
        refused = subprocess.run([BUILD / "bin/understory", "report", self.files / "drive.lcm"], capture_output=True, text=True)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("no SLAM_POSE", refused.stderr)

    def test_the_report_tells_of_health(self):
        with log.LogWriter(self.files / "live.lcm") as writer:
            for event in log.read(self.files / "run.lcm", ["SLAM_POSE", "MAP"]):
                writer.write(event.utime, event.channel, event.data)
            for second, (state, why) in enumerate([(1, ""), (1, ""), (2, "sweeps <late>"), (1, "sweeps <late>")]):
                health = understory.health_t()
                health.utime, health.process, health.state, health.last_error = 1_000_000 * second, "mapper", state, why
                health.latency_p50_us, health.latency_p99_us, health.rss_bytes = 2000, 30_000, 50_000_000
                writer.write(health.utime, "HEALTH", health)
        subprocess.run([BUILD / "bin/understory", "report", self.files / "live.lcm"], capture_output=True, check=True)
        text = (self.files / "live.html").read_text()
        self.assertIn("<td class=\"text\">DEGRADED</td><td class=\"text\">sweeps &lt;late&gt;</td>", text)
        self.assertEqual(text.count(">mapper<"), 3)  # Degraded, mended, and its times.

    def test_the_plot_is_a_picture(self):
        environment = {"PYTHONPATH": str(BUILD / "python"), "PATH": "/usr/bin:/bin", "HOME": self.folder.name}
        subprocess.run([sys.executable, "-m", "understory.plot", self.files / "run.lcm", self.files / "a.png"], env=environment, check=True)
        self.assertEqual((self.files / "a.png").read_bytes()[:4], b"\x89PNG")
        refused = subprocess.run([sys.executable, "-m", "understory.plot", self.files / "drive.lcm", self.files / "b.png"],
                                 env=environment, capture_output=True, text=True)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("no SLAM_POSE", refused.stderr)


if __name__ == "__main__":
    unittest.main()
