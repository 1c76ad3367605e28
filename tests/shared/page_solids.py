"""What a page of a spatial mechanism draws, without a browser."""

from __future__ import annotations

import json

from tests.shared.live import WEB
from tests.shared.node import run_script


def pose_of(scene, k):
    """Return places and turns of a pose as the page has them."""
    return {
        "places": {ref: own[k].tolist() for ref, own in scene.tracks.items()},
        "turns": {body: own[k].T.ravel().tolist() for body, own in scene.turns.items()},
        "share": 0.0,
        "senses": {},
    }


def placed(drawing, poses, basis, metre, folder):
    """Return the shapes of each pose as the page places them: id, kind, places."""
    given = json.dumps({"drawing": drawing, "basis": basis, "scale": metre, "size": [488, 306]})
    return run_script(
        f'import {{ SpaceDiagram }} from "{(WEB / "space.js").as_posix()}";\n'
        "const diagram = Object.create(SpaceDiagram.prototype);\n"
        f"Object.assign(diagram, {given}, {{ shift: [0, 0] }});\n"
        f"const shown = {json.dumps(poses)}.map((pose) =>\n"
        "  diagram.drawing.solids.flatMap((part) =>\n"
        "  diagram.shapes(part, pose).map(({ kind, places }) => [part.id, kind, places])));\n"
        "console.log(JSON.stringify(shown));\n",
        folder,
    )
