"""What the programs that make the scenarios' meshes share: OBJ text."""


def obj_text(comment, vertices, faces):
    """An OBJ file: a comment line, vertices [(x, y, z)] to nine decimals (never -0), faces [(i, j, k)] counted from 0."""
    lines = ["# " + comment]
    lines += ["v {:.9f} {:.9f} {:.9f}".format(*(round(c, 9) + 0.0 for c in v)) for v in vertices]
    lines += ["f {} {} {}".format(*(i + 1 for i in f)) for f in faces]
    return "\n".join(lines) + "\n"
