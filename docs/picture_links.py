"""Let a picture that stands alone lead to its file, where it can be seen as large as one likes."""

from docutils import nodes
from sphinx.application import Sphinx


def link(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Make a link of each image that is a paragraph of its own, and name the paragraph for the style sheet."""
    if app.builder.format != "html":
        return
    up = "../" * page.count("/")
    for image in list(doctree.findall(nodes.image)):
        paragraph = image.parent
        if isinstance(paragraph, nodes.paragraph) and len(paragraph) == 1 and image["uri"] in app.env.images:
            paragraph["classes"].append("picture")
            to_file = nodes.reference("", "", refuri=f"{up}_images/{app.env.images[image['uri']][1]}", internal=True)
            image.replace_self(to_file)
            to_file += image


def setup(app: Sphinx) -> dict[str, bool]:
    """Register it."""
    app.connect("doctree-resolved", link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
