"""The includes obey the table of modules in src/tendril/CMakeLists.txt, and the table has no cycle."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
SOURCES = ROOT / "src" / "tendril"
# Libraries that stay inside one module's folder, where every file is private: what an include begins with, the module.
WALLED = {"ompl/": "planner", "embree": "geometry", "assimp/": "geometry", "yaml-cpp/": "scenario", "sqlite3": "benchmark"}


def depends_table():
    """{module: set of modules it may include}."""
    table = {}
    text = re.sub(r"#.*", "", (SOURCES / "CMakeLists.txt").read_text())
    for call in re.findall(r"^tendril_module\(([^)]*)\)", text, re.MULTILINE):
        name, *words = call.split()
        part, depends = None, set()
        for word in words:
            if word in ("DEPENDS", "PUBLIC", "PRIVATE"):
                part = word
            elif part == "DEPENDS":
                depends.add(word)
        table[name] = depends
    return table


def module_of(file):
    """src/tendril/rod.h and src/tendril/rod/rod.cpp belong to rod."""
    return pathlib.PurePath(file).relative_to(SOURCES).parts[0].removesuffix(".h")


def includes():
    """(file, line number, what is included) of every #include of the library and the program."""
    for folder in (SOURCES, ROOT / "app"):
        for file in sorted(folder.rglob("*")):
            if file.suffix in (".h", ".cpp"):
                for number, line in enumerate(file.read_text().splitlines(), 1):
                    if match := re.match(r'\s*#\s*include\s*[<"]([^>"]+)[>"]', line):
                        yield file, number, match[1]


class Architecture(unittest.TestCase):
    def setUp(self):
        self.table = depends_table()

    def test_every_header_at_the_top_is_a_module_of_the_table(self):
        self.assertEqual(sorted(self.table), sorted(header.stem for header in SOURCES.glob("*.h")))

    def test_the_table_has_no_cycle(self):
        left = dict(self.table)
        while free := [name for name, depends in left.items() if not depends & left.keys()]:
            for name in free:
                del left[name]
        self.assertEqual(left, {}, "these modules depend on each other in a circle")

    def test_a_module_includes_only_what_the_table_allows(self):
        for file, number, included in includes():
            if not file.is_relative_to(SOURCES):
                continue
            target = self.target(file, included)
            if target and target.is_relative_to(SOURCES):
                own, other = module_of(file), module_of(target)
                self.assertTrue(other == own or other in self.table[own],
                                f"{file.relative_to(ROOT)}:{number}: {own} may not include {other}; see DEPENDS")

    def test_headers_inside_a_module_are_private_to_it(self):
        for file, number, included in includes():
            target = self.target(file, included)
            if target and target.is_relative_to(SOURCES) and target.parent != SOURCES:
                inside = file.is_relative_to(SOURCES) and module_of(file) == module_of(target)
                self.assertTrue(inside, f"{file.relative_to(ROOT)}:{number}: {included} is private")

    def test_a_library_stays_inside_the_folder_of_its_module(self):
        for file, number, included in includes():
            for prefix, module in WALLED.items():
                if included.startswith(prefix):
                    inside = file.is_relative_to(SOURCES / module)
                    self.assertTrue(inside, f"{file.relative_to(ROOT)}:{number}: {included} belongs in {module}/")

    @staticmethod
    def target(file, included):
        """The file of this project an #include names; None for any other."""
        for folder in (file.parent, SOURCES.parent):
            if (folder / included).is_file():
                return (folder / included).resolve()
        return None


if __name__ == "__main__":
    unittest.main()
