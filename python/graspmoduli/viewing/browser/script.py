"""What runs in the browser beside viser's own client."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files


def page_script(name: str) -> str:
    """An element that runs the page's script once: its title is ``name``.

    viser puts HTML into the page as it is. Scripts do not run there; what an image does that cannot
    be loaded does.
    """
    here = files(__package__ or "")
    style = (here / "page.css").read_text("utf-8")
    code = (here / "page.js").read_text("utf-8").replace("@STYLE@", style)
    code = code.replace('"@NAME@"', json.dumps(name))
    return f"<img src='data:,' alt='' hidden onerror=\"{escape(code, quote=True)}\">"
