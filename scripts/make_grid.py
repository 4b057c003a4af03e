#!/usr/bin/env python3
"""Writes the grid: eleven round bars across eleven others that lie on them (704 vertices, 1320 faces).

    scripts/make_grid.py > scenarios/meshes/grid.obj

All lengths are in metres for a rod of length 1 and radius 0.01. The bars along x lie below the plane z = 0 and those
along y above; each is a closed prism of sixteen sides. Where two bars cross they touch.
"""
import math
import sys

import obj

ROD_LENGTH, ROD_RADIUS = 1.0, 0.01
BARS = 11                                # in each direction
SIDES = 16
SPACING = 0.15 * ROD_LENGTH              # from axis to axis
BAR_RADIUS = ROD_RADIUS                  # of the circle about the prism
BAR_HALF_LENGTH = 0.85 * ROD_LENGTH


def bar(axis, offset, first):
    """Vertices and faces, counter-clockwise seen from outside, of the bar along x (0) or y (1)."""
    vertices, faces = [], []
    for along in (-BAR_HALF_LENGTH, BAR_HALF_LENGTH):
        for k in range(SIDES):
            angle = 2 * math.pi * k / SIDES
            across, up = offset + BAR_RADIUS * math.cos(angle), BAR_RADIUS * math.sin(angle)
            vertices.append((along, across, up - BAR_RADIUS) if axis == 0 else (across, -along, up + BAR_RADIUS))
    for k in range(SIDES):
        a, b = k, (k + 1) % SIDES
        c, d = a + SIDES, b + SIDES
        faces += [(a, b, d), (a, d, c)]
    for k in range(1, SIDES - 1):
        faces += [(0, k + 1, k), (SIDES, SIDES + k, SIDES + k + 1)]
    return vertices, [tuple(first + i for i in face) for face in faces]


def make_mesh():
    """Vertices [(x, y, z)] and faces [(i, j, k)]."""
    vertices, faces = [], []
    for axis in (0, 1):
        for k in range(BARS):
            v, f = bar(axis, (k - (BARS - 1) / 2) * SPACING, len(vertices))
            vertices += v
            faces += f
    return vertices, faces


def obj_text():
    return obj.obj_text("The grid, made by scripts/make_grid.py. Metres; the bars lie along x and y.", *make_mesh())


if __name__ == "__main__":
    sys.stdout.write(obj_text())
