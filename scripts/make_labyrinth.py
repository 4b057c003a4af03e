#!/usr/bin/env python3
"""Writes the labyrinth: a tube with three sharp bends, each in another plane, between two plates with funnels.

    scripts/make_labyrinth.py > scenarios/meshes/labyrinth.obj

All lengths are in metres for a rod of length 1 and radius 0.01. The tube runs along x, y, z and x again.
"""
import math
import sys

import make_double_funnel
import obj

ROD_LENGTH, ROD_RADIUS = 1.0, 0.01
SIDES = make_double_funnel.SIDES
TUBE_RADIUS = 1.5 * ROD_RADIUS           # of the circle inscribed in the tube's cross section
BEND_RADIUS = 8 * ROD_RADIUS             # of the tube's axis
BEND_STEPS = 12                          # 7.5 degrees each
STRAIGHT = 0.1 * ROD_LENGTH              # before, between and after the bends
MOUTH_RADIUS = 0.25 * ROD_LENGTH         # of the circle inscribed in the hole of each plate
FUNNEL_LENGTH = 0.25 * ROD_LENGTH
FUNNEL_RINGS = 4                         # from the plate to the tube, both ends included
PLATE_HALF_WIDTH = 1.3 * ROD_LENGTH      # wider than the workspace: there is no way around


def add(p, *terms):
    """p + the sum of factor * vector."""
    return tuple(c + sum(factor * vector[k] for factor, vector in terms) for k, c in enumerate(p))


def cross_sections():
    """(centre, along, u, v, inscribed radius) of each ring from mouth to mouth; u and v span its plane, and all three
    turn with the axis."""
    def funnel(k):
        return TUBE_RADIUS + (MOUTH_RADIUS - TUBE_RADIUS) * (k / (FUNNEL_RINGS - 1)) ** 2
    step = FUNNEL_LENGTH / (FUNNEL_RINGS - 1)
    centre, along, u, v = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    rings = []
    for k in range(FUNNEL_RINGS - 1):
        rings.append((add(centre, (k * step, along)), along, u, v, funnel(FUNNEL_RINGS - 1 - k)))
    centre = add(centre, (FUNNEL_LENGTH, along))
    rings.append((centre, along, u, v, TUBE_RADIUS))
    for to in ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)):  # the direction after each bend
        start = add(centre, (STRAIGHT, along))
        for k in range(BEND_STEPS + 1):
            angle = math.pi / 2 * k / BEND_STEPS
            turned = [turn(w, along, to, angle) for w in (along, u, v)]
            centre = add(start, (BEND_RADIUS * math.sin(angle), along), (BEND_RADIUS * (1 - math.cos(angle)), to))
            rings.append((centre, *turned, TUBE_RADIUS))
        _, along, u, v, _ = rings[-1]
    centre = add(centre, (STRAIGHT, along))
    for k in range(FUNNEL_RINGS):
        rings.append((add(centre, (k * step, along)), along, u, v, funnel(k)))
    return rings


def turn(w, a, b, angle):
    """w turned by the angle in the plane of the orthonormal a and b, from a to b."""
    wa, wb = (sum(x * y for x, y in zip(w, e)) for e in (a, b))
    c, s = math.cos(angle), math.sin(angle)
    return add(w, (c * wa - s * wb - wa, a), (s * wa + c * wb - wb, b))


def make_mesh():
    """Vertices [(x, y, z)] and faces [(i, j, k)], counter-clockwise seen from the free side (left, inside, right)."""
    rings = cross_sections()
    vertices, faces = [], []
    for centre, _, u, v, inscribed in rings:
        radius = inscribed / math.cos(math.pi / SIDES)
        for k in range(SIDES):
            angle = make_double_funnel.side_angle(k)
            vertices.append(add(centre, (radius * math.cos(angle), u), (radius * math.sin(angle), v)))
    faces += make_double_funnel.wall_faces(len(rings))
    for ring, flip in ((0, True), (len(rings) - 1, False)):
        centre, _, u, v, _ = rings[ring]
        first_corner, w = len(vertices), PLATE_HALF_WIDTH
        vertices += [add(centre, (w * a, u), (w * b, v)) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        plate = make_double_funnel.plate_faces(ring * SIDES, first_corner)
        faces += [(a, c, b) for a, b, c in plate] if flip else plate
    return vertices, faces


def obj_text():
    return obj.obj_text("The labyrinth, made by scripts/make_labyrinth.py. Metres.", *make_mesh())


if __name__ == "__main__":
    sys.stdout.write(obj_text())
