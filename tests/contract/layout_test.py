"""Holds the layout: which folder may know which, where each library's headers are, what the page may name.

    layout_test.py [SOURCE_FOLDER]
"""
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FOLDERS = ("settings", "tracker", "sim", "service")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)

# Folder -> what else it may include: folders ("settings/") or single headers.
MAY_INCLUDE = {
    "tracker": (),
    "settings": (),
    "sim": ("settings/", "tracker/types.hpp"),
    "service": ("settings/", "tracker/"),
}
ONLY_FILE_THAT_INCLUDES_SIM = "service/sources/simulator.cpp"
# The front can be used without the rest of the service.
SELF_CONTAINED = ("service/http",)
# Targets that a folder's own may link.
MAY_LINK = {
    "tracker": {"tracker", "types"},
    "settings": {"settings"},
    "sim": {"sim", "settings", "types"},
}

# Headers that spread if nobody looks: the files that may include them. Of those that are headers themselves
# nobody but these files may include one.
ALLOWED = {
    r"box2d/": {"sim/world/world.cpp"},
    r"apriltag": {"tracker/detect/apriltag.cpp", "sim/render/tags.cpp"},
    r"httplib\.h": {"service/http/seam.cpp"},
    r"boost/": {f"service/http/{file}" for file in ("front.cpp", "front_impl.hpp", "connection.cpp", "connection.hpp")},
    r"service/http/(front_impl|connection)\.hpp": {"service/http/front.cpp", "service/http/connection.cpp",
                                                   "service/http/connection.hpp"},
    r"lzma\.h": {"service/reproduce/xz.cpp"},
    r"cairo": {"service/tag_sheets.cpp"},
    r"(libav|libsw)": {"service/sources/live/stream_camera.cpp"},
    r"linux/videodev2": {"service/sources/live/v4l2_camera.cpp", "tests/service/live/fake_v4l2.hpp"},
    r"spdlog/": {"service/commands/serve.cpp"},
}
# The tracker has no threads, files, sockets or JSON, and reads no clock.
NOT_IN_TRACKER = re.compile(r"(thread|mutex|condition_variable|future|stop_token|fstream|iostream|cstdio|filesystem"
                            r"|unistd\.h|sys/.*|netinet/.*|nlohmann/.*|opencv2/(videoio|imgcodecs|highgui).*)")
CLOCK = re.compile(r"\w+_clock\s*::\s*now|\bgettimeofday\b|\bclock_gettime\b|\bstd::time\b|\bgetenv\b|\brandom_device\b")

PAGE_MAY_NAME = ("/page.js", "/simulator.js", "/page.css", "/icon.svg", "/openapi.json", "/api/v1/")
MACHINE_PATH = re.compile(r"(?<![\w.$}\-])/(?:work|root|home|Users|mnt|media)/[\w.-]+")
SKIPPED_FOLDERS = {".git", "build", "node_modules", "__pycache__"}


def sources(folder):
    return sorted(p for p in (ROOT / folder).rglob("*") if p.suffix in (".cpp", ".hpp"))


def name(path):
    return path.relative_to(ROOT).as_posix()


def read(path):
    return path.read_text(encoding="utf-8", errors="replace")


def without_comments(text):
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)


def includes(path):
    """(quoted or angled, header) of each include."""
    return INCLUDE.findall(without_comments(read(path)))


class Layout(unittest.TestCase):
    def test_folders_include_only_what_stands_above_them(self):
        for folder in FOLDERS:
            self.assertTrue(sources(folder), f"{folder} has no sources")
            for path in sources(folder):
                for _, header in includes(path):
                    first = header.split("/")[0]
                    if first not in FOLDERS + ("tests", "web") or first == folder:
                        continue
                    if first == "sim" and name(path) == ONLY_FILE_THAT_INCLUDES_SIM:
                        continue
                    self.assertTrue(any(header == h or (h.endswith("/") and header.startswith(h))
                                        for h in MAY_INCLUDE[folder]), f"{name(path)} includes {header}")

    def test_own_headers_are_named_from_the_top_and_exist(self):
        for folder in FOLDERS:
            for path in sources(folder):
                for mark, header in includes(path):
                    if mark == '"':
                        self.assertTrue((ROOT / header).is_file(), f"{name(path)} includes \"{header}\"")
                    self.assertNotIn("..", header, name(path))

    def test_the_front_stands_by_itself(self):
        for folder in SELF_CONTAINED:
            for path in sources(folder):
                for _, header in includes(path):
                    if header.split("/")[0] in FOLDERS:
                        self.assertTrue(header.startswith(folder + "/"), f"{name(path)} includes {header}")

    def test_targets_link_only_what_stands_above_them(self):
        for folder, allowed in MAY_LINK.items():
            for path in (ROOT / folder).rglob("CMakeLists.txt"):
                text = re.sub(r"#[^\n]*", "", read(path))
                linked = set(re.findall(r"skylight::(\w+)", text))
                self.assertLessEqual(linked, allowed, f"{name(path)} links what it must not know")

    def test_headers_that_must_not_spread_are_where_they_may_be(self):
        for folder in FOLDERS:
            for path in sources(folder):
                for _, header in includes(path):
                    for pattern, allowed in ALLOWED.items():
                        if re.match(pattern, header):
                            self.assertIn(name(path), allowed, f"{name(path)} includes {header}")

    def test_the_tracker_has_no_thread_file_socket_json_or_clock(self):
        for path in sources("tracker"):
            for _, header in includes(path):
                self.assertIsNone(NOT_IN_TRACKER.fullmatch(header), f"{name(path)} includes {header}")
            self.assertIsNone(CLOCK.search(without_comments(read(path))), f"{name(path)} reads a clock or the environment")

    def test_the_page_names_nothing_but_itself_and_the_contract(self):
        for path in sorted((ROOT / "web").iterdir()):
            if path.suffix not in (".html", ".js", ".css", ".svg"):
                continue
            text = re.sub(r"<!--.*?-->|/\*.*?\*/|^\s*//[^\n]*", "", read(path), flags=re.DOTALL | re.MULTILINE)
            for place in re.findall(r"""["'`](/[\w.][^"'`<>\s]*)""", text):
                self.assertTrue(place.startswith(PAGE_MAY_NAME), f"{name(path)} names {place}")
            self.assertEqual(re.findall(r"https?://(?!www\.w3\.org/2000/svg)[^\s\"'`<>]*", text), [], name(path))
            self.assertNotIn("@import", text, name(path))
            for module in re.findall(r"""\bimport\b[^;]*?["']([^"']+)["']""", text):
                self.assertTrue(module.startswith(("/", "./")), f"{name(path)} imports {module}")

    def test_the_page_keeps_to_a_strict_content_security_policy(self):
        html = read(ROOT / "web" / "index.html")
        self.assertIsNone(re.search(r"\sstyle\s*=|<style", html), "index.html styles inline")
        self.assertIsNone(re.search(r"\son\w+\s*=", html), "index.html handles events inline")
        self.assertIsNone(re.search(r"<script(?![^>]*\bsrc=)", html), "index.html has a script inline")
        for file in sorted((ROOT / "web").glob("*.js")):
            self.assertIsNone(re.search(r"\binnerHTML|\binsertAdjacentHTML|\bdocument\.write|\beval\(|new Function"
                                        r"""|\.cssText|setAttribute\(["']style""", read(file)),
                              f"{file.name} makes markup or styles from text")

    def test_no_file_names_a_place_of_one_machine(self):
        for path in self.files():
            for number, line in enumerate(read(path).splitlines(), start=1):
                found = MACHINE_PATH.search(line)
                self.assertIsNone(found, f"{name(path)}:{number}: {found and found.group()}")

    def files(self):
        def walk(folder):
            for path in sorted(folder.iterdir()):
                if path.is_symlink() or path.name in SKIPPED_FOLDERS:
                    continue
                if path.is_dir():
                    yield from walk(path)
                elif path.stat().st_size < 4 << 20 and b"\0" not in path.read_bytes():
                    yield path
        found = list(walk(ROOT))
        self.assertGreater(len(found), 50)
        return found


if __name__ == "__main__":
    if len(sys.argv) > 1 and not sys.argv[1].startswith("-"):
        ROOT = pathlib.Path(sys.argv.pop(1)).resolve()
    unittest.main(verbosity=2)
