"""Takes the one script that pages would load from the network out; docs/js does its work."""

import re

SHIM = re.compile(r'<script src="?https://unpkg\.com/iframe-worker/shim"?></script>')


def on_post_page(output: str, page: object, config: object) -> str:
    """The page with a script of the site's own."""
    depth = getattr(page, "url", "").count("/")
    own = f'<script src="{"../" * depth}js/file_worker.js"></script>'
    return SHIM.sub(own, output)


def on_post_template(output_content: str, template_name: str, config: object) -> str:
    """The same for pages that are none, such as 404."""
    return SHIM.sub('<script src="/js/file_worker.js"></script>', output_content)
