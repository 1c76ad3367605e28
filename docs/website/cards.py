"""Cards with pictures that a reader filters, and frames with live pages."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

import make_gallery

import mechdae as md
from mechdae.describe.file import library
from mechdae.draw.catalogue import PICTURES

FIRST = "four-bar-crank-rocker"
"""The mechanism on the first page."""
BARE = """
.lesson header, .lesson #side, .lesson #switches { display: none !important; }
.lesson { height: 100dvh !important; }
.lesson main { display: grid !important; grid-template: minmax(0, 1fr) / minmax(0, 1fr) !important;
  padding: 0.5rem !important; }
.lesson #stage { min-height: 0; } .lesson #diagram { flex: 1 1 0 !important; }
"""
"""What its live page leaves out there."""
HOME = (
    ("draw", "Draw", "A diagram, plans, curves, a GIF; an editor with the mouse.", "jansen-leg"),
    ("which-task", "Analyse", "Positions, all modes, velocities, forces, motions.",
     "quick-return-friction"),
    ("dimensions", "Find dimensions", "For a path, a function, poses, least loss.", "bean-curve"),
    ("prove", "Prove", "What is certified, and a file that others check.", "gorshkov-seven-link"),
)  # fmt: skip


@dataclass(frozen=True)
class Card:
    """A link with a picture, which may move, and the words that it is filtered by."""

    link: str
    title: str
    text: str
    picture: str = ""
    moves: bool = False
    facets: Mapping[str, Iterable[str]] = field(default_factory=dict)


def grid(cards: Iterable[Card], look: str = "cards") -> str:
    """Return cards as HTML."""
    return f'<div class="{look}">\n{"".join(map(_card, cards))}</div>\n'


def _card(card: Card) -> str:
    facets = escape(json.dumps({name: list(words) for name, words in card.facets.items()}))
    moves = " data-moves" if card.moves else ""
    picture = f'<img loading="lazy" src="{card.picture}" alt=""{moves}>' if card.picture else ""
    return (
        f'<a class="card" href="{card.link}" data-facets="{facets}"><span>{picture}</span>'
        f"<b>{escape(card.title)}</b><small>{escape(card.text)}</small></a>\n"
    )


def frame(place: str, title: str, share: bool = True) -> str:
    """Return a live page in a frame, with what a course page needs of it."""
    live = f'<iframe class="live" loading="lazy" src="{place}" title="{escape(title)}"></iframe>\n'
    alone = f'<p class="share"><a href="{place}">Alone in the window</a></p>\n'
    return live + alone if share else live.replace("live", "live bare", 1)


def home(live: Path) -> str:
    """Return the top of the first page: a mechanism to drag, four cards; write what they show."""
    live.mkdir(parents=True, exist_ok=True)
    page = md.page(FIRST).html.replace("</style>", BARE + "</style>", 1)
    (live / "home.html").write_text(page, encoding="utf-8")
    four = [
        Card(f"docs/how-to/{page}.html", title, text, f"small/{problem}.svg", True)
        for page, title, text, problem in HOME
    ]
    return (
        f"{frame('live/home.html', 'A four-bar to drag', share=False)}\n{grid(four, 'cards few')}"
    )


def gallery() -> str:
    """Return the cards of all pictures of the gallery."""
    cards = []
    for script, title, text in make_gallery.pictures():
        picture = f"../../_images/{script.stem}.svg"
        link = f"#{title.lower().replace(' ', '-')}"
        cards.append(Card(link, title, text.replace("`", ""), picture, facets=_facets(script)))
    return grid(cards)


def _facets(script: Path) -> dict[str, list[str]]:
    """Return what a script draws: kinds of pictures, plane or space, joints."""
    tree = ast.walk(ast.parse(script.read_text(encoding="utf-8")))
    texts = list(dict.fromkeys(str(node.value) for node in tree if isinstance(node, ast.Constant)))
    drawn = [md.load(name).mechanism for name in texts if name in library.names()]
    return {
        "shows": [name for name in texts if name in PICTURES] or ["figures"],
        **facets_of(drawn),
    }


def facets_of(mechanisms: Iterable[md.Mechanism]) -> dict[str, list[str]]:
    """Return in what mechanisms are, and their kinds of joints."""
    known = list(mechanisms)
    places = ["space" if mechanism.dimension == 3 else "plane" for mechanism in known]
    joints = {joint.kind for mechanism in known for joint in mechanism.joints.values()}
    return {"plane or space": sorted(set(places)), "joint": sorted(joints)}
