"""Lets the API pages show what stands beside attributes, and links instead of roles."""

import re
from typing import Any

from griffe import Attribute, Docstring, Extension, Object

ROLE = re.compile(r":(?:func|class|meth|attr|mod|data):`~?([\w.]+)`")


def _plain(match: re.Match[str]) -> str:
    name = match[1].removeprefix("graspmoduli.")
    return f"`{name}`" if match[1] == name else f"`gm.{name}`"


class Comments(Extension):
    """Comments `#: …` above an attribute are its docstring; roles become names in code."""

    def on_attribute_instance(self, *, attr: Attribute, **_: Any) -> None:
        """Reads the comment above the attribute."""
        if attr.docstring or not attr.lineno:
            return
        lines = attr.lines_collection[attr.filepath]
        above = []
        number = attr.lineno - 2
        while number >= 0 and lines[number].strip().startswith("#:"):
            above.append(lines[number].strip()[2:].strip())
            number -= 1
        if above:
            text = ROLE.sub(_plain, " ".join(reversed(above)))
            attr.docstring = Docstring(text, lineno=number + 2, parent=attr)

    def on_instance(self, *, obj: Object, **_: Any) -> None:
        """Writes roles as code."""
        if obj.docstring:
            obj.docstring.value = ROLE.sub(_plain, obj.docstring.value)
