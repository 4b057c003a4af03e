#!/usr/bin/env python3
"""Writes the double funnel: two square plates joined by a funnel, a narrow tunnel and a funnel (198 vertices, 388 faces).

    scripts/make_double_funnel.py > scenarios/meshes/double-funnel.obj
    scripts/make_double_funnel.py 1.1 > scenarios/meshes/critical-tunnel-1.10.obj

The number is the tunnel's radius in radii of the rod, 3 unless given. All lengths are in metres for a rod of length 1
and radius 0.01. The axis is x; the surface is mirror-symmetric in x.
"""
import math
import sys

import obj

ROD_LENGTH, ROD_RADIUS = 1.0, 0.01
SIDES = 19
TUNNEL_HALF_LENGTH = ROD_LENGTH          # the tunnel is two rods long
TUNNEL_RADII = 3                         # rod radii: of the cylinder inscribed in the tunnel
MOUTH_RADIUS = 0.5 * ROD_LENGTH          # of the circle inscribed in the hole of each plate
FUNNEL_LENGTH = 0.5 * ROD_LENGTH
FUNNEL_RINGS = 4                         # from the plate to the tunnel, both ends included
PLATE_HALF_WIDTH = 1.1 * ROD_LENGTH      # wider than the workspace: there is no way around


def profile(tunnel_radii):
    """(x, inscribed radius) of the ten rings: the funnels are trumpets, radius growing with the square."""
    tunnel_radius = tunnel_radii * ROD_RADIUS
    right = []
    for k in range(FUNNEL_RINGS):
        u = k / (FUNNEL_RINGS - 1)
        right.append((TUNNEL_HALF_LENGTH + FUNNEL_LENGTH * u, tunnel_radius + (MOUTH_RADIUS - tunnel_radius) * u * u))
    middle = TUNNEL_HALF_LENGTH / 3
    left = [(-x, radius) for x, radius in reversed(right)]
    return left + [(-middle, tunnel_radius), (middle, tunnel_radius)] + right


def side_angle(k):
    return 2 * math.pi * k / SIDES


def make_mesh(tunnel_radii=TUNNEL_RADII):
    """Vertices [(x, y, z)] and faces [(i, j, k)], counter-clockwise seen from the free side (left, inside, right)."""
    rings = profile(tunnel_radii)
    vertices, faces = [], []
    for x, inscribed in rings:
        radius = inscribed / math.cos(math.pi / SIDES)
        for k in range(SIDES):
            vertices.append((x, radius * math.cos(side_angle(k)), radius * math.sin(side_angle(k))))
    faces += wall_faces(len(rings))
    for ring, flip in ((0, True), (len(rings) - 1, False)):
        first_corner = len(vertices)
        x, w = rings[ring][0], PLATE_HALF_WIDTH
        vertices += [(x, w, w), (x, -w, w), (x, -w, -w), (x, w, -w)]
        plate = plate_faces(ring * SIDES, first_corner)
        faces += [(a, c, b) for a, b, c in plate] if flip else plate
    return vertices, faces


def wall_faces(rings):
    """The faces between so many rings of SIDES vertices each, numbered from 0 on ring by ring."""
    faces = []
    for ring in range(rings - 1):
        for k in range(SIDES):
            a, b = ring * SIDES + k, ring * SIDES + (k + 1) % SIDES
            c, d = a + SIDES, b + SIDES
            faces += [(a, d, b), (a, c, d)]
    return faces


def plate_faces(first_of_ring, first_corner):
    """The square minus the polygon, 4 + 19 faces, counter-clockwise seen from +x: each side of the polygon goes to the
    corner of its quadrant, each side of the square to the polygon's vertex between the two quadrants."""
    def quadrant(k):
        return int((side_angle(k) + math.pi / SIDES) / (math.pi / 2)) % 4
    faces = []
    for k in range(SIDES):
        here, there = first_of_ring + k, first_of_ring + (k + 1) % SIDES
        q, q_next = quadrant(k), quadrant((k + 1) % SIDES)
        faces.append((here, first_corner + q, there))
        if q != q_next:
            faces.append((there, first_corner + q, first_corner + q_next))
    return faces


def obj_text(tunnel_radii=TUNNEL_RADII):
    return obj.obj_text("The double funnel, made by scripts/make_double_funnel.py. Metres; the axis is x.", *make_mesh(tunnel_radii))


if __name__ == "__main__":
    sys.stdout.write(obj_text(*map(float, sys.argv[1:])))
