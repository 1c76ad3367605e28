"""What live pages add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {
    "commands": {
        "page": Added(
            "mechdae.parts.page.commands.page",
            after="plot",
            about="a live page of a mechanism, one HTML file",
        ),
        "edit": Added(
            "mechdae.parts.page.commands.edit",
            after="explain",
            about="an editor of mechanisms, one HTML file",
        ),
    },
    "documents": {"page": Added("mechdae.parts.page.commands.page:plotted")},
    "formats": {
        "c": Added(
            "mechdae.parts.page.programs.c_kernel:c",
            after="urdf",
            about="kernel in C: pose and rates from driver and parameters",
        ),
        "js": Added(
            "mechdae.parts.page.programs.js_kernel:js",
            after="c",
            about="the same as a JavaScript module",
        ),
    },
}
