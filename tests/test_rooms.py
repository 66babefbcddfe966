"""The rooms of the package: the paper ← objects ← viewing ← experiments and the command line."""

import ast
import re
from itertools import pairwise

import pytest

import graspmoduli as gm
from conftest import ROOT

PACKAGE = ROOT / "python" / "graspmoduli"
#: From the inside out: a room imports from those before it, and from itself.
ROOMS = ["", "objects", "viewing", "experiments", "cli"]
#: Modules that only give the name of before to what moved into a room; the public face does so too.
NAMES = {"__init__", "fitting", "plotting", "reading"}
#: And the entry that `python -m graspmoduli` runs.
ENTRIES = {"__main__"}


def module_of(path):
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 1 else parts)


MODULES = {module_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def room_of(module):
    first = module.split(".")[0]
    return first if first in ROOMS else ""


def imported(module, *, lazily=True):
    """Modules of the package that one imports; imports inside of functions are lazy."""
    path = MODULES[module]
    package = path.relative_to(PACKAGE).parent.parts
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree) if lazily else tree.body:
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        base = [*package[: len(package) - node.level + 1]]
        base += node.module.split(".") if node.module else []
        for alias in node.names:
            longer, shorter = ".".join([*base, alias.name]), ".".join(base)
            found = longer if longer in MODULES else shorter
            if found in MODULES and found != module:
                yield found


@pytest.mark.parametrize("module", sorted(MODULES.keys() - NAMES - ENTRIES))
def test_arrows_run_one_way(module):
    own = ROOMS.index(room_of(module))
    for other in imported(module):
        assert ROOMS.index(room_of(other)) <= own, f"{module} imports {other}"
        assert other not in NAMES - {"__init__"}, f"{module} imports {other}, a name of before"


def test_there_is_no_circle():
    def visit(module, way):
        assert module not in way, " → ".join([*way[way.index(module) :], module])
        for other in imported(module, lazily=False):
            if other not in done and other != "__init__":
                visit(other, [*way, module])
        done.add(module)

    done: set[str] = set()
    for module in MODULES:
        if module not in done:
            visit(module, [])
    assert done >= set(MODULES)


def test_the_search_for_arrows_finds_them():
    assert "objects.reading" in set(imported("objects.fitting"))
    assert "_core" not in MODULES
    assert "viewing.plotting" in set(imported("plotting"))
    assert "objects.fitting" in set(imported("viewing.plotting"))
    assert all(MODULES[module].exists() for module in MODULES)
    assert list(pairwise(ROOMS))


def test_names_of_before_are_the_same_things():
    from graspmoduli import fitting, plotting, reading
    from graspmoduli.objects import fitting as fits
    from graspmoduli.objects import reading as files
    from graspmoduli.viewing import plotting as pictures

    assert fitting.fit is fits.fit is gm.fit
    assert fitting.Fit is gm.Fit
    assert reading.read is files.read
    for name in ("grasps", "path", "quality", "row", "rows", "simplex", "surface"):
        assert getattr(plotting, f"plot_{name}") is getattr(pictures, f"plot_{name}")


CORE = ROOT / "crates" / "graspmoduli" / "src"


def rust_modules():
    """Modules of the core by their paths, such as ("quality", "plane")."""
    found = {}
    for path in sorted(CORE.rglob("*.rs")):
        parts = path.relative_to(CORE).with_suffix("").parts
        found[tuple(part for part in parts if part not in ("mod", "lib"))] = path
    return found


def spelled_out(path):
    """a::{b, c::{d}} as a::b and a::c::d."""
    if "{" not in path:
        return [path.strip()]
    head, _, rest = path.partition("{")
    parts, depth = [""], 0
    for letter in rest[: rest.rindex("}")]:
        depth += {"{": 1, "}": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [name for part in parts if part.strip() for name in spelled_out(head + part)]


def used_in_rust(module, modules):
    """Modules of the core that one uses outside of its tests; one that only gives names of its own
    children to others does not count as using them."""
    text = re.sub(r"//.*", "", modules[module].read_text().split("#[cfg(test)]")[0])
    paths = re.findall(r"\buse ((?:crate|super)\b[^;]*);", text)
    paths += re.findall(r"(?<![\w:])((?:crate|super)(?:::\w+)+)", text)
    for path in paths:
        for name in spelled_out(re.sub(r"\s", "", path)):
            parts, base = name.split("::"), list(module)
            if parts[0] == "crate":
                base = []
                del parts[0]
            while parts and parts[0] == "super":
                base.pop()
                del parts[0]
            whole = [*base, *(part for part in parts if part != "self")]
            known = (tuple(whole[:k]) for k in range(len(whole), 0, -1))
            found = next((m for m in known if m in modules and m != module), None)
            if found is not None:
                yield found


def test_nor_is_there_one_in_the_core():
    modules = rust_modules()
    assert ("quality", "three_contacts") in modules
    assert ("quality", "plane") in set(used_in_rust(("quality", "three_contacts"), modules))
    uses = {module: set(used_in_rust(module, modules)) for module in modules}
    # What nothing is left to use goes, again and again: what stays is in a circle or leads there.
    while free := [m for m, others in uses.items() if not others & uses.keys()]:
        for module in free:
            del uses[module]
    assert not uses, f"circles among {sorted('::'.join(m) for m in uses)}"


def test_files_are_short():
    lengths = [
        len(p.read_text().splitlines()) for p in [*CORE.rglob("*.rs"), *PACKAGE.rglob("*.py")]
    ]
    assert max(lengths) <= 500
    assert sorted(lengths)[len(lengths) // 2] <= 150
