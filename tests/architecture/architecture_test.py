"""The test of the architecture test: every rule finds a bad example and lets a good one pass."""

import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import architecture  # noqa: E402

RULES = architecture.load_rules(Path(__file__).resolve().parent / "rooms.toml")


class Tree(unittest.TestCase):
    """Writes small trees and asks which rules they break."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = Path(self.folder.name)
        for room in RULES["rooms"]:
            self.write(f"{room}/README.md", "A room.\n")
            self.write(f"{room}/good.hpp", "#pragma once\n")

    def tearDown(self):
        self.folder.cleanup()

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text, encoding="utf-8")

    def findings(self):
        return [str(finding) for finding in architecture.check(self.root, RULES)]

    def assert_finds(self, *words):
        findings = self.findings()
        self.assertEqual(len(findings), 1, findings)
        for word in words:
            self.assertIn(word, findings[0])

    def assert_clean(self):
        self.assertEqual(self.findings(), [])

    def test_good_tree_is_clean(self):
        self.write("sfm/mapping/a.cpp", '#include "sfm/scene/good.hpp"\n#include <ceres/ceres.h>\n')
        self.write("tools/a.cpp", '#include "drivers/camera/replay/good.hpp"\n#include "sfm/mapping/good.hpp"\n')
        self.assert_clean()

    def test_finds_arrow_from_lower_to_upper_room(self):
        self.write("sfm/scene/a.cpp", '// first line\n#include "sfm/mapping/good.hpp"\n')
        self.assert_finds("sfm/scene/a.cpp:2", "forbidden arrow sfm/scene -> sfm/mapping")

    def test_finds_sfm_that_knows_a_device(self):
        self.write("sfm/mapping/a.cpp", '#include "drivers/camera/good.hpp"\n')
        self.assert_finds("forbidden arrow sfm/mapping -> drivers/camera")

    def test_finds_pipeline_that_names_a_backend(self):
        self.write("firmware/pipeline/a.hpp", '#pragma once\n#include "drivers/camera/replay/good.hpp"\n')
        self.assert_finds("forbidden arrow firmware/pipeline -> drivers/camera/replay")

    def test_finds_product_that_uses_tests(self):
        self.write("tools/a.cpp", '#include "tests/good.hpp"\n')
        self.assert_finds("forbidden arrow tools -> tests")

    def test_finds_relative_include_and_unknown_room(self):
        self.write("sfm/scene/a.cpp", '#include "good.hpp"\n')
        self.assert_finds("include paths start at the repository root")
        self.write("sfm/scene/a.cpp", "")
        self.write("sfm/attic/README.md", "An attic.\n")
        self.write("sfm/attic/a.hpp", '#pragma once\n#include "sfm/scene/good.hpp"\n')
        self.assert_finds("sfm/attic/a.hpp", "not a room")

    def test_finds_heavy_header_in_a_header_only(self):
        self.write("sfm/mapping/a.hpp", "#pragma once\n#include <opencv2/core/mat.hpp>\n")
        self.write("sfm/mapping/a.cpp", "#include <opencv2/imgproc.hpp>\n")
        self.assert_clean()
        self.write("sfm/mapping/a.hpp", "#pragma once\n#include <opencv2/imgproc.hpp>\n")
        self.assert_finds("sfm/mapping/a.hpp:2", "heavy header")

    def test_finds_modules_that_never_enter(self):
        self.write("sfm/mapping/a.cpp", "#include <opencv2/imgcodecs.hpp>\n")
        self.assert_finds("never enters the firmware")

    def test_finds_threads_clocks_logging_and_files_in_sfm(self):
        for code, rule in (
            ("std::jthread worker;", "no threads"),
            ("auto t = std::chrono::steady_clock::now();", "no clock"),
            ('std::printf("x");', "no logging"),
            ("std::cerr << 1;", "no logging"),
            ('std::ifstream file("x");', "no files"),
            ("std::random_device device;", "deterministic"),
            ('auto* home = std::getenv("HOME");', "no hidden environment"),
        ):
            with self.subTest(code):
                self.write("sfm/mapping/a.cpp", code + "\n")
                self.assert_finds("sfm/mapping/a.cpp:1", rule)

    def test_ignores_words_in_comments_and_texts(self):
        self.write(
            "sfm/mapping/a.cpp",
            "// std::thread\n/* std::cout\n std::rand */ const char* s = \"std::jthread \\\" std::cerr\";\n"
            "const char* r = R\"(std::async)\";\nint n = 1'000'000;\n(void)std::snprintf(b, 1, \"\");\n",
        )
        self.assert_clean()

    def test_finds_token_after_a_digit_separator(self):
        self.write("sfm/mapping/a.cpp", "int n = 1'000'000; std::cout << n; int m = 2'000;\n")
        self.assert_finds("no logging")

    def test_exception_holds_for_its_file_and_rule_only(self):
        self.write("firmware/base/check.hpp", "#pragma once\nstd::fprintf(stderr);\n")
        self.assert_clean()
        self.write("firmware/base/other.hpp", "#pragma once\nstd::fprintf(stderr);\n")
        self.assert_finds("firmware/base/other.hpp:2", "no logging")

    def test_finds_long_file(self):
        self.write("sfm/mapping/a.cpp", "int x;\n" * 601)
        self.assert_finds("at most 600 lines", "601")

    def test_finds_folder_without_readme(self):
        self.write("tools/dev/check", "#!/bin/sh\n")
        self.assert_finds("tools/dev", "README.md")

    def test_finds_header_without_guard(self):
        self.write("sfm/mapping/a.hpp", "int x;\n")
        self.assert_finds("#pragma once")

    def test_finds_machine_path_but_not_every_slash(self):
        place = "/" + "work"
        self.write("sfm/mapping/a.cpp", f"// output{place}/x, `out`{place}/y, ${{DIR}}{place}/z\n")
        self.assert_clean()
        self.write("sfm/mapping/a.cpp", f"// see {place}/x\n")
        self.assert_finds("path of one machine")

    def test_finds_broken_link_in_readme(self):
        self.write("tools/README.md", "[there](good.hpp) [web](https://example.org) [gone](gone.md)\n")
        self.assert_finds("link to a file that is not there", "gone.md")


if __name__ == "__main__":
    unittest.main()
