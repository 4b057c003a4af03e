"""Runs the built program the way a person does; shared by the tests beside this file."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TENDRIL = os.environ.get("TENDRIL", str(ROOT / "build" / "release" / "tendril"))
FREE_SPACE = ROOT / "scenarios" / "free-space.yaml"
DOUBLE_FUNNEL = ROOT / "scenarios" / "double-funnel.yaml"
DONE, NO, BAD_INPUT = 0, 1, 2


class Case(unittest.TestCase):
    """A test with a folder of its own, in which the program runs."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="tendril test ")  # a path with a space, on purpose
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name).resolve()

    def tendril(self, *arguments, expect=DONE):
        """Standard output and standard error; fails unless the exit status is `expect`."""
        done = subprocess.run([TENDRIL, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, expect, f"{arguments}\nstdout: {done.stdout}\nstderr: {done.stderr}")
        return done.stdout, done.stderr

    def tendril_json(self, *arguments, expect=DONE):
        """The one JSON object that --json prints."""
        stdout, _ = self.tendril(*arguments, "--json", expect=expect)
        found = json.loads(stdout)
        self.assertIsInstance(found, dict)
        return found

    def write(self, name, text):
        file = self.folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    def variant(self, scenario, *replacements, name="variant.yaml"):
        """A copy of a scenario with (old, new) replaced, its meshes found where they are."""
        text = scenario.read_text().replace("file: meshes/", f"file: {scenario.parent}/meshes/")
        for old, new in replacements:
            self.assertIn(old, text)
            text = text.replace(old, new)
        return self.write(name, text)

    def files(self):
        return sorted(path.relative_to(self.folder) for path in self.folder.rglob("*"))

    def assert_refused(self, *arguments, saying=()):
        """Exit status 2, a message on standard error with every word of `saying`, nothing printed, nothing written."""
        before = self.files()
        stdout, stderr = self.tendril(*arguments, expect=BAD_INPUT)
        self.assertEqual(stdout, "")
        for word in saying:
            self.assertIn(str(word), stderr)
        self.assertTrue(stderr.strip())
        self.assertEqual(self.files(), before)
        return stderr
