#!/usr/bin/env python3
"""Writes the way back of scenarios: start and goal exchanged, next to each as NAME-reversed.yaml.

    scripts/exchange_start_goal.py scenarios/engine.yaml [...]

Works on the text of block-style files as they are in scenarios/: all else, comments included, stays as it is. The
goal's tolerance belongs to whatever is the goal.
"""
import pathlib
import re
import sys

HEAD = "# Start and goal exchanged by scripts/exchange_start_goal.py.\n"


def blocks(text):
    """The top-level blocks [key or None, text], in order; joined they are the text. What stands before the first key,
    or as unindented comments after it, has no key."""
    result = [[None, ""]]
    for line in text.splitlines(keepends=True):
        key = re.match(r"(\w+):", line)
        if key:
            result.append([key[1], line])
        elif line.startswith("#") and result[-1][0] is not None:
            result.append([None, line])
        else:
            result[-1][1] += line
    return result


def split_tolerance(goal):
    """The goal's block without its tolerance, and the tolerance's lines."""
    found = re.search(r"^  tolerance:.*\n(?:   .*\n)*", goal, re.MULTILINE)
    return (goal.replace(found[0], ""), found[0]) if found else (goal, "")


def exchanged(text):
    """The text of the scenario with start and goal exchanged and "-reversed" after its name."""
    parts = blocks(text if text.endswith("\n") else text + "\n")
    at = {key: k for k, (key, _) in enumerate(parts) if key}
    missing = [key for key in ("name", "start", "goal") if key not in at]
    if missing:
        raise ValueError("no top-level block " + ", ".join(missing))
    start = parts[at["start"]][1]
    goal, tolerance = split_tolerance(parts[at["goal"]][1])
    parts[at["start"]][1] = re.sub(r"^goal:", "start:", goal)
    parts[at["goal"]][1] = re.sub(r"^start:", "goal:", start) + tolerance
    parts[at["name"]][1] = re.sub(r"^(name:\s*[\w.-]+)", r"\1-reversed", parts[at["name"]][1])
    return HEAD + "".join(part for _, part in parts)


def main(files):
    if not files:
        sys.exit(__doc__)
    for file in map(pathlib.Path, files):
        if file.stem.endswith("-reversed"):
            continue
        try:
            text = exchanged(file.read_text())
        except (OSError, ValueError) as error:
            sys.exit(f"{file}: {error}")
        file.with_name(file.stem + "-reversed.yaml").write_text(text)


if __name__ == "__main__":
    main(sys.argv[1:])
