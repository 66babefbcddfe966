"""Files of every format, and what may become of them on the way."""

import io

import numpy as np
import trimesh
from hypothesis import strategies as st
from trimesh.exchange.stl import export_stl_ascii

#: Files that are read as points.
CLOUDS = ("xyz", "npy", "pcd", "binary pcd")


def files():
    """One object in every format, by name: bytes."""
    mesh = trimesh.creation.icosphere(2)
    mesh.apply_scale([1.0, 1.0, 1.7])
    points = np.asarray(mesh.vertices, np.float32)
    found = {}
    for kind in ("obj", "off", "stl", "glb"):
        data = mesh.export(file_type=kind)
        found[kind] = data.encode() if isinstance(data, str) else data
    found["ascii stl"] = export_stl_ascii(mesh).encode()
    found["ply"] = mesh.export(file_type="ply")
    found["ascii ply"] = mesh.export(file_type="ply", encoding="ascii")
    rows = "\n".join(" ".join(f"{x:.7g}" for x in point) for point in points).encode() + b"\n"
    found["xyz"] = rows
    buffer = io.BytesIO()
    np.save(buffer, points)
    found["npy"] = buffer.getvalue()
    header = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA "
    ).encode()
    found["pcd"] = header + b"ascii\n" + rows
    found["binary pcd"] = header + b"binary\n" + points.tobytes()
    return found


def cut(data, at, _):
    return data[: int(at * len(data))]


def flip(data, at, value):
    place = min(int(at * len(data)), len(data) - 1)
    return data[:place] + bytes([value]) + data[place + 1 :]


def zeroed(data, at, value):
    place = int(at * len(data))
    return data[:place] + bytes(min(4 * value, len(data) - place)) + data[place + 4 * value :]


def nan(data, at, value):
    """A number of an ASCII file, or four bytes of a binary one, that is none."""
    word = (b" nan ", b" inf ", b" 1e999 ", b" -1 ", np.float32(np.nan).tobytes())[value % 5]
    place = int(at * len(data))
    return data[:place] + word + data[place + len(word) :]


def count(data, at, value):
    """A digit of the head that is another: announced counts."""
    digits = [k for k, byte in enumerate(data[:400]) if 48 <= byte <= 57]
    if not digits:
        return data
    return flip(data, digits[int(at * (len(digits) - 1))] / len(data), 48 + value % 10)


def moved(data, at, value):
    """A piece repeated, or left out."""
    place = int(at * len(data))
    piece = data[place : place + value]
    return data[:place] + (2 * piece if value % 2 else b"") + data[place + value :]


#: One to three of them, at a share of the file.
changes = st.lists(
    st.tuples(
        st.sampled_from([cut, flip, zeroed, nan, count, moved]),
        st.floats(0.0, 1.0, exclude_max=True),
        st.integers(0, 255),
    ),
    min_size=1,
    max_size=3,
)


def changed(data, what):
    for change, at, value in what:
        if data:
            data = change(data, at, value)
    return data
