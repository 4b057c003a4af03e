#!/usr/bin/env python3
"""Writes the rack: two parallel round bars between two square plates (two closed prisms of sixteen sides, two boxes).

    scripts/make_rack.py > scenarios/meshes/rack.obj

All lengths are in metres for a rod of length 1 and radius 0.01. The bars lie along x, side by side in the plane z = 0.
"""
import math
import sys

import obj

ROD_LENGTH, ROD_RADIUS = 1.0, 0.01
SIDES = 16
BAR_RADIUS = 1.5 * ROD_RADIUS            # of the circle about the prism
BAR_OFFSET = 0.03 * ROD_LENGTH           # of each axis from the x axis
BAR_HALF_LENGTH = 0.4 * ROD_LENGTH       # from plate to plate
PLATE_HALF_WIDTH = 0.2 * ROD_LENGTH
PLATE_THICKNESS = 0.02 * ROD_LENGTH


def prism(profile, x_min, x_max, first):
    """Vertices and faces, counter-clockwise seen from outside, of the convex profile [(y, z)], counter-clockwise about
    x, swept along x."""
    n = len(profile)
    vertices = [(x, y, z) for x in (x_min, x_max) for y, z in profile]
    faces = []
    for k in range(n):
        a, b = k, (k + 1) % n
        faces += [(a, b, b + n), (a, b + n, a + n)]
    for k in range(1, n - 1):
        faces += [(0, k + 1, k), (n, n + k, n + k + 1)]
    return vertices, [tuple(first + i for i in face) for face in faces]


def make_mesh():
    """Vertices [(x, y, z)] and faces [(i, j, k)]."""
    angles = [2 * math.pi * k / SIDES for k in range(SIDES)]
    w = PLATE_HALF_WIDTH
    plate = [(w, -w), (w, w), (-w, w), (-w, -w)]
    solids = [([(centre + BAR_RADIUS * math.cos(a), BAR_RADIUS * math.sin(a)) for a in angles],
               -BAR_HALF_LENGTH, BAR_HALF_LENGTH) for centre in (-BAR_OFFSET, BAR_OFFSET)]
    solids += [(plate, x, x + PLATE_THICKNESS) for x in (-BAR_HALF_LENGTH - PLATE_THICKNESS, BAR_HALF_LENGTH)]
    vertices, faces = [], []
    for solid in solids:
        v, f = prism(*solid, len(vertices))
        vertices += v
        faces += f
    return vertices, faces


def obj_text():
    return obj.obj_text("The rack, made by scripts/make_rack.py. Metres; the bars lie along x.", *make_mesh())


if __name__ == "__main__":
    sys.stdout.write(obj_text())
