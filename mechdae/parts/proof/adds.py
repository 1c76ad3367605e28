"""What certificates add."""

from __future__ import annotations

from mechdae.additions import Added, Adds

ADDS: Adds = {
    "commands": {
        "certify": Added(
            "mechdae.parts.proof.commands.certify",
            after="rank",
            about="a certificate of a sweep or of modes, or the check of one",
        ),
    },
}
