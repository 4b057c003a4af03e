#!/usr/bin/python3
"""Draws docs/images/validation/*.svg from the tables that bench_validation wrote.

A tool for the study only: it needs matplotlib (Debian: python3-matplotlib), which nothing else in the project does. Run it
with the system's interpreter: /usr/bin/python3 bench/plot_validation.py [tables] [images]
"""
import csv
import pathlib
import sys

import matplotlib
matplotlib.use("svg")
import matplotlib.pyplot as plt

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLES = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "bench/results/validation"
IMAGES = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "docs/images/validation"
plt.rcParams.update({"svg.hashsalt": "tendril", "svg.fonttype": "none", "font.size": 9, "figure.facecolor": "white",
                     "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
                     "lines.linewidth": 1.2, "lines.markersize": 4, "axes.titlesize": 9})


def number(text):
    try:
        return float(text)
    except ValueError:
        return text


def table(name):
    with open(TABLES / f"{name}.csv", newline="") as file:
        return [{key: number(value) for key, value in row.items()} for row in csv.DictReader(file)]


def groups(rows, *keys):
    """{values of the keys: rows}, in the table's order."""
    out = {}
    for row in rows:
        values = tuple(row[key] for key in keys)
        out.setdefault(values if len(keys) > 1 else values[0], []).append(row)
    return out


def column(rows, key):
    return [row[key] for row in rows]


def save(figure, name):
    figure.tight_layout()
    figure.savefig(IMAGES / f"{name}.svg", metadata={"Date": None})
    plt.close(figure)


def order_line(axes, x, y, order, label):
    """A line through (x[0], y) along which y goes with x to the power `order`."""
    axes.loglog(x, [y * (at / x[0]) ** order for at in x], "--", color="0.6", linewidth=0.8, label=label)


def in_elements(axes, unit="L"):
    axes.set_xlabel("elements")
    axes.set_ylabel(f"largest distance of a node [{unit}]")
    axes.set_xticks([10, 20, 40, 80], ["10", "20", "40", "80"])
    axes.minorticks_off()
    axes.legend(fontsize=8)


def cantilever():
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2))
    for name, rows in groups(table("cantilever_shapes"), "shape").items():
        style = "k-" if str(name).startswith("exact") else "C0o"
        left.plot(column(rows, "x"), column(rows, "z"), style, linewidth=0.8, markersize=2.5,
                  label={"exact 0.1": "boundary value problem", "simulated 0.1": "20 elements"}.get(name))
    left.set_aspect("equal")
    left.set(xlabel="x [L]", ylabel="z [L]", title="$\\Gamma$ = 0.1 ... 1000")
    left.legend(fontsize=8, loc="lower right")
    for gamma, rows in groups(table("cantilever"), "gamma").items():
        if gamma in (1, 10, 100, 1000):
            right.loglog(column(rows, "elements"), column(rows, "max_node_error_L"), "o-", label=f"$\\Gamma$ = {gamma:g}")
    order_line(right, [10, 20, 40, 80], 2e-3, -4, "order 4")
    in_elements(right)
    save(figure, "cantilever")


def swing():
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3))
    for name, rows in groups(table("swing_tips"), "what").items():
        left.plot(column(rows, "time_s"), column(rows, "z"), "ko" if name == "explicit" else "-",
                  label="explicit finite differences" if name == "explicit" else name.replace("_", " "))
    left.set(xlabel="time [s]", ylabel="height of the tip [m]")
    left.legend(fontsize=7)
    for scheme, rows in groups([row for row in table("swing") if row["elements"] == 40 and row["dt_s"] != 0.00025],
                               "scheme").items():
        steps = [1e3 * dt for dt in column(rows, "dt_s")]
        for key, style in (("error_at_0.5s_mm", "o-"), ("error_at_1s_mm", "s:")):
            right.loglog(steps, column(rows, key), style, label=f"{scheme.replace('_', ' ')}, {key[9:-3]}")
    order_line(right, [20, 0.5], 6, 2, "order 2")
    order_line(right, [20, 0.5], 120, 1, "order 1")
    right.set(xlabel="time step [ms]", ylabel="error of the tip [mm]")
    right.legend(fontsize=6, loc="lower right")
    save(figure, "swing")


def energy():
    figure, axes = plt.subplots(figsize=(6, 2.8))
    for (scheme, dt), rows in groups(table("energy"), "scheme", "dt_s").items():
        axes.plot(column(rows, "time_s"), [1e3 * e for e in column(rows, "energy_J")],
                  label=f"{scheme.replace('_', ' ')}, {1e3 * dt:g} ms")
    axes.set(xlabel="time [s]", ylabel="energy [mJ]")
    axes.set_ylim(-12, 1)
    axes.legend(fontsize=7)
    save(figure, "energy")


def two_ends():
    figure, axes = plt.subplots(1, 2, figsize=(8, 2.8))
    for one, key in zip(axes, "zy"):
        for name, rows in groups(table("two_ends_shapes"), "shape").items():
            exact = str(name).startswith("exact")
            one.plot(column(rows, "x"), column(rows, key), "k-" if exact else "o", linewidth=0.8, markersize=3,
                     label=None if exact else f"E = {name.split()[1]} Pa")
        one.set_aspect("equal")
        one.set(xlabel="x [m]", ylabel=f"{key} [m]")
    axes[1].legend(fontsize=8)
    save(figure, "two-ends")


def buckling():
    figure, axes = plt.subplots(figsize=(6, 2.8))
    for what, rows in groups([row for row in table("buckling") if row["method"] == "simulation"], "what").items():
        theory = rows[0]["theory"]
        middle = [100 * (0.5 * (row["low"] + row["high"]) / theory - 1) for row in rows]
        half = [50 * (row["high"] - row["low"]) / theory for row in rows]
        axes.errorbar(column(rows, "elements"), middle, half, fmt="o-", capsize=3, label=what)
    axes.axhline(0, color="k", linewidth=0.6)
    axes.set_xscale("log")
    axes.set_xticks([10, 20, 40, 80], ["10", "20", "40", "80"])
    axes.minorticks_off()
    axes.set(xlabel="elements", ylabel="critical load, off theory [%]")
    axes.legend(fontsize=8)
    save(figure, "buckling")


def curl():
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(8, 3.2), width_ratios=(1, 1, 1.3))
    for weight, rows in groups(table("curl_shapes"), "shape").items():
        left.plot(column(rows, "y"), column(rows, "z"), label=f"{weight:g}")
        middle.plot(column(rows, "x"), column(rows, "z"))
    for axes, key in ((left, "y"), (middle, "x")):
        axes.set_aspect("equal")
        axes.set(xlabel=f"{key} [L]", ylabel="z [L]")
    left.legend(fontsize=7, title="$\\Gamma$", loc="lower left")
    left.set_title("in the plane")
    middle.set_title("out of it")
    for weight, rows in groups(table("curl_rest"), "weight").items():
        right.loglog(column(rows, "elements"), column(rows, "max_node_error_L"), "o-", label=f"$\\Gamma$ = {weight:g}")
    order_line(right, [10, 20, 40, 80], 3e-3, -4, "order 4")
    in_elements(right)
    save(figure, "curl")


def capstan():
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 2.8))
    for mu, rows in groups(table("capstan_shapes"), "shape").items():
        if mu == 0.3:
            left.plot(column(rows, "x"), column(rows, "z"), "o-", markersize=2)
    left.add_patch(plt.Circle((0, 0), 0.1, color="0.85"))
    left.set_aspect("equal")
    left.set(xlabel="x [m]", ylabel="z [m]", title="$\\mu$ = 0.3, half a turn")
    rows = [row for row in table("capstan") if row["elements"] == 100 and row["sides"] == 128]
    right.semilogy([row["mu"] * row["angle_rad"] for row in rows], column(rows, "ratio"), "o", label="simulated")
    right.semilogy([0, 1.6], [1, 2.718281828 ** 1.6], "k-", linewidth=0.8, label="$e^{\\mu\\theta}$")
    right.set(xlabel="$\\mu\\theta$", ylabel="$T_2/T_1$")
    right.set_yticks([1, 2, 3, 4, 5], ["1", "2", "3", "4", "5"])
    right.minorticks_off()
    right.legend()
    save(figure, "capstan")


def slope():
    figure, axes = plt.subplots(figsize=(6, 2.8))
    for index, (mu, rows) in enumerate(groups([row for row in table("slope") if row["lies"] == "along"], "mu").items()):
        axes.plot(column(rows, "tan_slope_over_mu"), column(rows, "theory_m_s"), "-", color=f"C{index}", linewidth=0.8)
        axes.plot(column(rows, "tan_slope_over_mu"), column(rows, "speed_after_1s_m_s"), "o", color=f"C{index}",
                  label=f"$\\mu$ = {mu:g}")
    axes.set_yscale("symlog", linthresh=0.1)
    axes.set(xlabel="$\\tan\\alpha/\\mu$", ylabel="speed after 1 s [m/s]")
    axes.legend(fontsize=8, title="lines: Coulomb", title_fontsize=8)
    save(figure, "slope")


def plectoneme():
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3), width_ratios=(1, 1.2))
    rows = groups(table("plectoneme_shapes"), "shape")["5 turns"]
    left.plot(column(rows, "x"), column(rows, "z"), "-", linewidth=4, solid_capstyle="round")
    left.set_aspect("equal")
    left.set(xlabel="x [m]", ylabel="z [m]", title="five turns")
    for (turns, contact, elements), rows in groups(table("plectoneme"), "turns", "self_contact", "elements").items():
        if elements == 100:
            right.plot(column(rows, "time_s"), column(rows, "self_distance_over_2r"),
                       label=f"{turns:g} turns" + ("" if contact else ", no self-contact"))
    right.axhline(1, color="k", linewidth=0.6)
    right.set(xlabel="time [s]", ylabel="distance to itself [2r]")
    right.legend(fontsize=8)
    save(figure, "plectoneme")


def rest():
    figure, axes = plt.subplots(figsize=(5, 3))
    for kind, rows in groups(table("rest"), "kind").items():
        line, = axes.loglog(column(rows, "elements"), column(rows, "largest_L"), "o-", label=kind)
        axes.loglog(column(rows, "elements"), column(rows, "median_L"), "o:", color=line.get_color())
    order_line(axes, [10, 20, 40, 80], 3e-2, -4, "order 4")
    in_elements(axes)
    axes.set_title("largest (lines) and median (dots) of 20 rods")
    save(figure, "rest")


if __name__ == "__main__":
    IMAGES.mkdir(parents=True, exist_ok=True)
    for draw in (cantilever, swing, energy, two_ends, buckling, curl, capstan, slope, plectoneme, rest):
        draw()
