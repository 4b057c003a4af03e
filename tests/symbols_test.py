"""Every code name of docs/symbols.md occurs in the file that its row names, and every row is complete."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
COLUMNS = ["symbol", "meaning", "unit", "frame", "code name", "source", "file"]


def rows():
    """The rows of the page's tables as (line number, cells)."""
    for number, line in enumerate((ROOT / "docs/symbols.md").read_text().splitlines(), 1):
        if line.startswith("|") and not set(line) <= set("|- "):
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            if cells != COLUMNS:
                yield number, cells


class Symbols(unittest.TestCase):
    def test_every_row_is_complete(self):
        for number, cells in rows():
            self.assertEqual(len(cells), len(COLUMNS), f"docs/symbols.md:{number}: {cells}")
            self.assertTrue(all(cells), f"docs/symbols.md:{number}: an empty cell; write - for none")

    def test_every_code_name_occurs_in_its_file(self):
        found = 0
        for number, cells in rows():
            text = ""
            for file in cells[6].split(";"):
                path = ROOT / file.strip()
                self.assertTrue(path.is_file(), f"docs/symbols.md:{number}: no file {file.strip()}")
                text += path.read_text()
            names = re.findall(r"`([^`]+)`", cells[4])
            self.assertTrue(names, f"docs/symbols.md:{number}: no code name")
            for name in names:
                self.assertTrue(re.search(rf"\b{re.escape(name)}\b", text),
                                 f"docs/symbols.md:{number}: {name} does not occur in {cells[6]}")
                found += 1
        self.assertGreater(found, 50)


if __name__ == "__main__":
    unittest.main()
