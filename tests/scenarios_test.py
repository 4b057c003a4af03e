"""The committed meshes are what their programs make, or what their makers made, and are the surfaces they claim to be."""
import collections
import math
import pathlib
import sys
import unittest

from double_funnel_test import cross, read_obj

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENARIOS = ROOT / "scenarios"
MESHES = SCENARIOS / "meshes"
sys.path.insert(0, str(ROOT / "scripts"))
import make_double_funnel
import make_grid
import make_labyrinth
import make_rack

ROD_RADIUS = 0.01


def dot(u, v):
    return sum(x * y for x, y in zip(u, v))


def minus(u, v):
    return tuple(x - y for x, y in zip(u, v))


def directed_edges(faces):
    edges = collections.Counter()
    for a, b, c in faces:
        edges.update(((a, b), (b, c), (c, a)))
    return edges


def pieces(vertices, faces):
    """The faces of each connected piece."""
    parent = list(range(len(vertices)))

    def root(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i
    for a, b, c in faces:
        parent[root(b)] = parent[root(a)]
        parent[root(c)] = parent[root(a)]
    found = collections.defaultdict(list)
    for face in faces:
        found[root(face[0])].append(face)
    return list(found.values())


def volume(vertices, faces):
    """Of a closed surface, positive where its faces look outwards."""
    return sum(dot(vertices[a], cross(vertices[b], vertices[c])) for a, b, c in faces) / 6


def axis_of(vertices, faces):
    """(centre, direction index) of a piece that is longest along one of the axes."""
    corners = [vertices[i] for face in faces for i in face]
    low, high = ([f(p[k] for p in corners) for k in range(3)] for f in (min, max))
    size = minus(high, low)
    return tuple((a + b) / 2 for a, b in zip(low, high)), max(range(3), key=lambda k: size[k])


def to_triangle(p, a, b, c):
    """Distance of a point to a triangle: to its plane where the foot lies inside, else to its nearest edge."""
    normal = cross(minus(b, a), minus(c, a))
    if all(dot(cross(minus(v, u), minus(p, u)), normal) >= 0 for u, v in ((a, b), (b, c), (c, a))):
        return abs(dot(minus(p, a), normal)) / math.sqrt(dot(normal, normal))
    distances = []
    for u, v in ((a, b), (b, c), (c, a)):
        edge = minus(v, u)
        t = min(1, max(0, dot(minus(p, u), edge) / dot(edge, edge)))
        distances.append(math.dist(p, tuple(x + t * y for x, y in zip(u, edge))))
    return min(distances)


class MadeByPrograms(unittest.TestCase):
    def test_the_files_are_what_the_programs_make(self):
        for name, program in (("grid", make_grid), ("labyrinth", make_labyrinth), ("rack", make_rack)):
            self.assertEqual((MESHES / f"{name}.obj").read_text(), program.obj_text(), name)

    def test_the_critical_tunnels_are_double_funnels_that_a_cylinder_of_so_many_radii_just_fits(self):
        files = sorted(MESHES.glob("critical-tunnel-*.obj"))
        self.assertEqual([file.stem[-4:] for file in files], ["1.02", "1.05", "1.10", "1.25", "1.50", "2.00"])
        for file in files:
            radii = float(file.stem[-4:])
            self.assertEqual(file.read_text(), make_double_funnel.obj_text(radii))
            self.assertIn(f"meshes/{file.name}", (SCENARIOS / f"{file.stem}.yaml").read_text())
            vertices, faces = read_obj(file)
            walls = [face for face in faces if all(abs(vertices[i][0]) <= 1 for i in face)]
            self.assertEqual(len(walls), 3 * 2 * 19)
            for a, b, c in (tuple(vertices[i] for i in face) for face in walls):
                normal = cross(minus(b, a), minus(c, a))
                self.assertAlmostEqual(-dot(a, normal) / math.sqrt(dot(normal, normal)), radii * ROD_RADIUS, delta=1e-8)


class Grid(unittest.TestCase):
    def setUp(self):
        self.vertices, self.faces = read_obj(MESHES / "grid.obj")
        self.bars = pieces(self.vertices, self.faces)

    def test_it_has_704_vertices_and_1320_faces(self):
        self.assertEqual((len(self.vertices), len(self.faces)), (704, 1320))

    def test_it_is_22_closed_bars_of_sixteen_sides_with_32_vertices_and_60_faces_each(self):
        self.assertEqual(len(self.bars), 22)
        for bar in self.bars:
            self.assertEqual((len({i for face in bar for i in face}), len(bar)), (32, 60))
            edges = directed_edges(bar)
            self.assertEqual(max(edges.values()), 1)
            self.assertTrue(all(edge[::-1] in edges for edge in edges))
            base = 8 * ROD_RADIUS**2 * math.sin(math.pi / 8)  # the 16-gon in a circle of the bar's radius
            self.assertAlmostEqual(volume(self.vertices, bar), base * 1.7, delta=1e-9)

    def test_eleven_bars_touch_eleven_others_that_cross_them_and_no_two_overlap(self):
        along = [[], []]
        for bar in self.bars:
            centre, k = axis_of(self.vertices, bar)
            self.assertAlmostEqual(centre[2], (-ROD_RADIUS, ROD_RADIUS)[k], delta=1e-9)
            along[k].append(centre[1 - k])
        for offsets in along:
            self.assertEqual(len(offsets), 11)
            for k, offset in enumerate(sorted(offsets)):
                self.assertAlmostEqual(offset, 0.15 * (k - 5), delta=1e-9)


class Rack(unittest.TestCase):
    def test_it_is_two_closed_bars_from_plate_to_plate(self):
        vertices, faces = read_obj(MESHES / "rack.obj")
        self.assertEqual((len(vertices), len(faces)), (80, 144))
        solids = sorted(volume(vertices, piece) for piece in pieces(vertices, faces))
        bar, plate = 8 * 0.015**2 * math.sin(math.pi / 8) * 0.8, 0.4 * 0.4 * 0.02
        for found, expected in zip(solids, (bar, bar, plate, plate), strict=True):
            self.assertAlmostEqual(found, expected, delta=1e-9)


class Labyrinth(unittest.TestCase):
    def setUp(self):
        self.vertices, self.faces = read_obj(MESHES / "labyrinth.obj")

    def test_it_is_one_oriented_tube_whose_only_boundary_is_the_rims_of_the_two_plates(self):
        edges = directed_edges(self.faces)
        self.assertEqual(max(edges.values()), 1)
        boundary = [edge for edge in edges if edge[::-1] not in edges]
        self.assertEqual(len(boundary), 8)
        self.assertEqual({self.vertices[i][0] for edge in boundary for i in edge}, {0, 0.86})
        self.assertEqual(len(self.vertices) - (len(edges) + len(boundary)) // 2 + len(self.faces), 0)

    def test_a_ball_of_one_and_a_half_rod_radii_just_follows_an_axis_with_three_bends_of_eight_in_three_planes(self):
        r = 8 * ROD_RADIUS
        bends = [((0.35, r, 0), (0, -1, 0), (1, 0, 0)),       # centre, and two directions from it: where the axis
                 ((0.43, 0.18, r), (0, 0, -1), (0, 1, 0)),    # enters and where it leaves
                 ((0.43 + r, 0.26, 0.18), (-1, 0, 0), (0, 0, 1))]
        triangles = [tuple(self.vertices[i] for i in face) for face in self.faces]
        for centre, enter, leave in bends:
            for k in range(25):
                angle = math.pi / 2 * k / 24
                p = tuple(c + r * (math.cos(angle) * a + math.sin(angle) * b) for c, a, b in zip(centre, enter, leave))
                near = [t for t in triangles if any(math.dist(p, v) < 0.12 for v in t)]
                distance = min(to_triangle(p, *t) for t in near)
                self.assertLessEqual(distance, 1.5 * ROD_RADIUS + 1e-8)
                self.assertGreater(distance, 1.47 * ROD_RADIUS)  # facets of 7.5 degrees cut that much off


class FromOthers(unittest.TestCase):
    MESHES = {
        "engine_cylinder_head.ply": (55465, 109935, '"Engine Cylinder Head" by fasteng', ["engine_cylinder_head-licence.txt"]),
        "powerplant_clinic_bay.ply": (20914, 42017, "BSI (2020)", [
            "buildingSMART-Community-Sample-Test-Files-LICENSE.txt", "buildingSMART-Medical-Dental-Clinic-README.md"]),
    }

    def test_their_counts_are_those_of_the_originals(self):
        for name, (vertices, faces, _, _) in self.MESHES.items():
            header = (MESHES / name).read_bytes().split(b"end_header\n")[0].decode()
            self.assertIn(f"element vertex {vertices}\n", header)
            self.assertIn(f"element face {faces}\n", header)

    def test_their_licences_are_beside_them_and_every_scenario_names_maker_and_licence(self):
        for name, (_, _, maker, licences) in self.MESHES.items():
            for licence in licences:
                self.assertRegex((MESHES / "licences" / licence).read_text(), r"(?i)creative ?commons")
            users = [file for file in SCENARIOS.glob("*.yaml") if f"meshes/{name}" in file.read_text()]
            self.assertGreaterEqual(len(users), 2)
            for file in users + [ROOT / "README.md", ROOT / "docs" / "scenarios.md"]:
                for credit in (maker, "CC BY 4.0"):
                    self.assertTrue(credit in file.read_text(), f"{file.name} does not name {credit}")


class EveryScenario(unittest.TestCase):
    def test_it_bears_its_files_name_and_has_a_section_in_the_docs(self):
        docs = (ROOT / "docs" / "scenarios.md").read_text()
        for file in SCENARIOS.glob("*.yaml"):
            name = file.stem.removesuffix("-reversed")
            self.assertIn(f"\nname: {file.stem}\n", file.read_text())
            self.assertIn(f"`{name}`", docs)


if __name__ == "__main__":
    unittest.main()
