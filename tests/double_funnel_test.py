"""The committed double funnel is what its program makes, and is the surface it claims to be."""
import collections
import math
import pathlib
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "scripts"))
import make_double_funnel


def read_obj(file):
    vertices, faces = [], []
    for line in file.read_text().splitlines():
        kind, *words = line.split()
        if kind == "v":
            vertices.append(tuple(map(float, words)))
        elif kind == "f":
            faces.append(tuple(int(word) - 1 for word in words))
    return vertices, faces


def cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


class DoubleFunnel(unittest.TestCase):
    def setUp(self):
        self.file = ROOT / "scenarios" / "meshes" / "double-funnel.obj"
        self.vertices, self.faces = read_obj(self.file)
        self.normals = []  # twice the area long
        for face in self.faces:
            a, b, c = (self.vertices[i] for i in face)
            self.normals.append(cross([q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]))

    def test_the_file_is_what_the_program_makes(self):
        self.assertEqual(self.file.read_text(), make_double_funnel.obj_text())

    def test_it_has_198_vertices_and_388_faces(self):
        self.assertEqual((len(self.vertices), len(self.faces)), (198, 388))
        self.assertEqual({i for face in self.faces for i in face}, set(range(198)))

    def test_it_is_one_oriented_manifold_whose_only_boundary_is_the_rims_of_the_two_plates(self):
        directed = collections.Counter()
        for a, b, c in self.faces:
            directed.update(((a, b), (b, c), (c, a)))
        self.assertEqual(max(directed.values()), 1)
        boundary = [edge for edge in directed if edge[::-1] not in directed]
        self.assertEqual(len(boundary), 8)
        for edge in boundary:
            for vertex in edge:
                self.assertEqual(tuple(map(abs, self.vertices[vertex])), (1.5, 1.1, 1.1))
        edges = (len(directed) + len(boundary)) // 2
        self.assertEqual(len(self.vertices) - edges + len(self.faces), 0)  # Euler: a tube

    def test_the_plates_cover_the_square_up_to_the_funnels_mouth(self):
        mouth = 19 * 0.5**2 * math.tan(math.pi / 19)  # the 19-gon about a circle of radius 0.5
        for side in (-1, 1):
            areas = [side * normal[0] / 2 for face, normal in zip(self.faces, self.normals)
                     if all(self.vertices[i][0] == side * 1.5 for i in face)]
            self.assertEqual(len(areas), 23)
            self.assertGreater(min(areas), 0)  # faces the free side, and so no two overlap
            self.assertAlmostEqual(sum(areas), 2.2**2 - mouth, delta=1e-7)

    def test_the_tunnel_is_two_rods_long_and_a_cylinder_of_three_rod_radii_just_fits(self):
        distances = []
        for face, normal in zip(self.faces, self.normals):
            if all(abs(self.vertices[i][0]) <= 1 for i in face):
                length = math.sqrt(sum(n * n for n in normal))
                point = self.vertices[face[0]]
                distances.append(-sum(n * p for n, p in zip(normal, point)) / length)  # from the axis, inwards
        self.assertEqual(len(distances), 3 * 2 * 19)
        for distance in distances:
            self.assertAlmostEqual(distance, 0.03, delta=1e-8)


if __name__ == "__main__":
    unittest.main()
