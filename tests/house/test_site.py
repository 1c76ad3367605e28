"""The documentation site: what it is made of, what it refuses; ``.ci/run`` builds it whole."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import sys
from pathlib import Path
from urllib.parse import quote

import pytest

import mechdae as md
from tests.shared.browser import browser, until
from tests.shared.paths import ROOT, document_pages

sys.path.insert(0, str(ROOT / "docs"))
import make_site
from website import api, cards, problems, stage, thumbs

__all__ = ["browser"]


@pytest.fixture(scope="module")
def staged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("site")
    stage.stage(target)
    stage.contents(target, {"Reference": api.write(target)})
    return target


def test_every_page_is_in_the_contents_of_the_site(staged: Path) -> None:
    contents = (staged / "index.md").read_text(encoding="utf-8")
    for page in [*document_pages(), ROOT / "CHANGELOG.md"]:
        name = str(page.relative_to(ROOT).with_suffix(""))
        assert name == "docs/index" or f"\n{name}\n" in contents, name
    assert "First steps <README>" in contents


def test_former_names_of_pages_lead_on(tmp_path: Path) -> None:
    stage.redirects(tmp_path)
    former = sorted((tmp_path / "docs").glob("**/*.html"))
    assert len(former) > 30
    for page in former:
        (link,) = re.findall(r"url=([^\"]+)", page.read_text(encoding="utf-8"))
        today = (page.parent / link).resolve().relative_to(tmp_path.resolve())
        assert (ROOT / today.with_suffix(".md")).exists(), link
        assert not (ROOT / page.relative_to(tmp_path).with_suffix(".md")).exists(), page.name


def test_files_that_pages_link_to_are_there(staged: Path) -> None:
    for page in stage.pages():
        text = (staged / page).read_text(encoding="utf-8")
        for link in re.findall(r"\]\(([^)\s#]+)[^)\s]*\)", text):
            if not re.match(r"[a-z]+:", link):
                assert (staged / page).parent.joinpath(link).exists(), f"{page}: {link}"


def test_every_public_name_has_its_entry(staged: Path) -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in (staged / "api").glob("*.rst"))
    named = re.findall(r"auto(?:class|function):: mechdae\.(\w+)$", text, re.M)
    assert sorted(named) == sorted(set(md.__all__) - {"__version__"})


def test_documents_that_the_reference_names_are_staged(staged: Path) -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in (staged / "api").glob("*.rst"))
    named = re.findall(r":doc:`/([^`]+)`", text)
    assert named
    assert all((staged / f"{name}.md").exists() for name in named)


def test_quantities_have_units_and_shapes(staged: Path) -> None:
    text = " ".join((staged / "api/results.rst").read_text(encoding="utf-8").split())
    assert "* - ``coriolis`` - m/s2 - (n, 2)" in text
    assert "* - ``reaction`` - Fx [N], Fy [N], M [N m] - (n, 3)" in text


@pytest.mark.parametrize(
    ("text", "asks"),
    [
        ('<script src="https://x.org/a.js"></script>', True),
        ('<link rel="stylesheet" href="//x.org/a.css">', True),
        ("<style>@import url(https://x.org/a.css)</style>", True),
        ('<iframe loading="lazy" src="http://x.org"></iframe>', True),
        ('<a href="https://x.org">x</a><img src="a.svg">', False),
        ('<link rel="stylesheet" href="a.css"><script src="a.js"></script>', False),
    ],
)
def test_requests_to_other_hosts_are_found(text: str, asks: bool, tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text(text, encoding="utf-8")
    for name in ("a.svg", "a.css", "a.js"):
        (tmp_path / name).touch()
    assert bool(list(make_site.faults(tmp_path))) == asks


def test_files_that_are_not_there_are_found(tmp_path: Path) -> None:
    text = (
        '<a href="b.html#x">b</a><img alt="" src="c%20d.svg"><a href="#y">y</a><a href="?q">q</a>'
    )
    (tmp_path / "a.html").write_text(text, encoding="utf-8")
    (tmp_path / "c d.svg").touch()
    assert list(make_site.faults(tmp_path)) == ["a.html names what is not there: b.html"]


def test_other_folders_and_files_are_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("furo", reason="the extra docs is not installed")
    pytest.importorskip("myst_parser", reason="the extra docs is not installed")
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    assert make_site.main(["--out", str(tmp_path)]) == 2
    assert "nothing was written" in capsys.readouterr().err
    assert make_site.main(["--out", str(tmp_path / "mine.txt")]) == 2
    assert "is a file" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pages of four problems, sources of the site."""
    target = tmp_path_factory.mktemp("problems")
    names = ["slider-crank", "c1-line6-free", "delta-robot", "car-axis"]
    assert problems.write(target, names, workers=1) == ["problems/index.md"]
    return target


def test_a_problem_has_live_page_curves_structure_numbers_and_file_in_this_order(
    built: Path,
) -> None:
    text = (built / "problems/slider-crank.md").read_text(encoding="utf-8")
    parts = [
        'loading="lazy" src="../live/slider-crank.html"', "](slider-crank-curves.svg)",
        "<details><summary>Structure", "I(1) -> II.2 RRP(2,3)",
        "<details><summary>Numbers of task", "(19 of 361 poses",
        "<details><summary>Problem file",
        (ROOT / "problems/slider-crank.toml").read_text(encoding="utf-8").strip(),
    ]  # fmt: skip
    places = [text.index(part) for part in parts]
    assert places == sorted(places)
    assert text.count("</details>") == 3
    svg = (built / "problems/slider-crank-curves.svg").read_text(encoding="utf-8")
    assert svg.startswith("<?xml")
    page = (built / "_live/live/slider-crank.html").read_text(encoding="utf-8")
    assert 'id="mechdae"' in page
    design = (built / "problems/c1-line6-free.md").read_text(encoding="utf-8")
    assert "](c1-line6-free-diagram.svg)" in design
    assert "iframe" not in design


def test_a_card_says_by_what_it_is_filtered(built: Path) -> None:
    index = (built / "problems/index.md").read_text(encoding="utf-8")
    found = re.findall(r'href="([\w-]+)\.html" data-facets="([^"]*)"', index)
    facets = {name: json.loads(html.unescape(words)) for name, words in found}
    assert list(facets) == ["c1-line6-free", "car-axis", "delta-robot", "slider-crank"]
    assert facets["delta-robot"]["plane or space"] == ["space"]
    assert facets["slider-crank"]["joint"] == ["prismatic", "revolute"]
    assert facets["car-axis"]["kind"] == ["Motion under forces, equilibria"]
    assert facets["c1-line6-free"]["shows"] == ["synthesis"]
    assert not re.search(r"\n\s*\n", index[index.index("<div") :]), "a blank line ends HTML"


def test_small_pictures_take_the_colours_of_the_page_and_move(built: Path) -> None:
    index = (built / "problems/index.md").read_text(encoding="utf-8")
    for name in ("slider-crank", "delta-robot", "car-axis"):
        still = (built / f"_live/small/{name}.svg").read_text(encoding="utf-8")
        moving = (built / f"_live/small/{name}-moves.svg").read_text(encoding="utf-8")
        assert f'src="../small/{name}.svg" alt="" data-moves' in index
        assert still.count("<g visibility") == 1
        assert 1 < moving.count("<g visibility") <= thumbs.FRAMES, name
        for text in (still, moving):
            body = text.partition("</style>")[2]
            assert "prefers-color-scheme:dark" in text
            assert not re.search(r'(fill|stroke)="#', body)
            assert "<use" not in body, "letters are too small to be read"
        assert len(still) < 20_000
        assert len(moving) < thumbs.HEAVY


def test_the_first_page_drags_the_live_page_and_its_cards_lead_to_pages(tmp_path: Path) -> None:
    top = cards.home(tmp_path)
    assert (tmp_path / "home.html").read_text(encoding="utf-8").count(cards.BARE) == 1
    links = re.findall(r'<a class="card" href="([^"]+)\.html"', top)
    assert len(links) == 4
    assert all((ROOT / f"{link}.md").exists() for link in links)
    assert all(f'src="small/{name}.svg"' in top for *_, name in cards.HOME)


def test_the_gallery_has_a_card_for_each_picture(staged: Path) -> None:
    text = (staged / "docs/reference/gallery.md").read_text(encoding="utf-8")
    links = re.findall(r'<a class="card" href="#([^"]+)"', text)
    titles = [title.lower().replace(" ", "-") for title in re.findall(r"^## (.*)$", text, re.M)]
    assert links == titles
    found = re.search(r'href="#rssr-views" data-facets="([^"]*)"', text)
    assert found is not None
    assert json.loads(html.unescape(found[1])) == {
        "shows": ["diagram"],
        "plane or space": ["space"],
        "joint": ["revolute", "spherical"],
    }


# -- in a browser ----------------------------------------------------------------------------------


@pytest.mark.slow
def test_cards_are_filtered_and_move(browser, built: Path) -> None:
    text = (built / "problems/index.md").read_text(encoding="utf-8")
    static = ROOT / "docs/website/static"
    (built / "problems/cards.html").write_text(
        f"<!DOCTYPE html><link rel='stylesheet' href='{static}/site.css'><article>"
        f"{text[text.index('<div') :]}</article><script src='{static}/site.js'></script>",
        encoding="utf-8",
    )
    shutil.copytree(built / "_live/small", built / "small")
    page = browser.new_page(viewport={"width": 360, "height": 700})
    page.goto(f"file://{built}/problems/cards.html")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    every = "[...document.querySelectorAll('.card')]"
    shown = f"{every}.filter(c => c.offsetHeight).map(c => c.innerText)"
    assert len(page.evaluate(shown)) == 4
    page.locator("[name='plane or space']").select_option("space")
    (card,) = page.evaluate(shown)
    assert "delta-robot" in card
    assert page.locator("output").inner_text() == "1 of 4"
    page.locator("[name='plane or space']").select_option("")
    page.locator("[name=joint]").select_option("prismatic")
    page.get_by_label("words").fill("crank SLIDER")
    (card,) = page.evaluate(shown)
    assert "slider-crank" in card
    picture = page.locator(".card:has-text('slider-crank') img")
    assert picture.get_attribute("src") == "../small/slider-crank.svg"
    picture.hover()
    assert picture.get_attribute("src").endswith("small/slider-crank-moves.svg")
    until(page, "document.querySelector('img[src*=moves]').naturalWidth > 0")
    page.close()


@pytest.mark.slow
def test_a_live_page_is_dragged_on_the_first_page_and_copied_from_the_others(
    browser, tmp_path: Path
) -> None:
    cards.home(tmp_path / "live")
    live, static = cards.frame("live/home.html", "a < b"), ROOT / "docs/website/static"
    (tmp_path / "a.html").write_text(f"{live}<script src='{static}/site.js'></script>")
    page = browser.new_page(viewport={"width": 360, "height": 420})
    page.goto(f"file://{tmp_path}/live/home.html")
    page.evaluate("mechdae.ready")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    assert not page.locator("#side").is_visible()
    before = page.evaluate("mechdae.pose().driver['crank.angle']")
    box = page.locator("#diagram").bounding_box()
    slider = page.locator("#drive input[type=range]").bounding_box()
    assert 0 < box["height"] < slider["y"] + slider["height"] <= 420
    box = page.locator("[data-id='point-coupler.P']").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + 30, box["y"] + 5)
    page.mouse.up()
    until(page, f"mechdae.pose().driver['crank.angle'] !== {before}")
    page.goto(f"file://{tmp_path}/a.html")
    page.get_by_text("Copy link").click()
    address = f"file://{tmp_path}/live/home.html"
    assert page.locator(".share input").input_value() == address
    page.get_by_text("Embed").click()
    made = page.locator(".share input").input_value()
    assert f'src="{address}"' in made
    assert 'title="a &lt; b"' in made or 'title="a < b"' in made
    assert made.startswith("<iframe ")
    page.close()


# -- the search ------------------------------------------------------------------------------------

QUESTIONS = {
    "coupler curve": "reference/measures",
    "status limit": "reference/statuses",
    "pin friction": "reference/forces",
    "MuJoCo export": "how-to/exchange",
    "which key holds a driver at a value": "how-to/drivers",
    "how do I get the torque": "how-to/torque",
    "make a GIF": "how-to/draw",
    "read a DXF": "how-to/exchange",
    "all assembly modes": "how-to/modes",
    "which results are certified": "how-to/prove",
}
"""What readers type, and the page below ``docs/`` that answers."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, staged: Path) -> Path:
    """The site, as `MECHDAE_SITE` names it, or built anew without the pages of problems."""
    if "MECHDAE_SITE" in os.environ:
        return Path(os.environ["MECHDAE_SITE"])
    pytest.importorskip("furo", reason="the extra docs is not installed")
    target = tmp_path_factory.mktemp("built")
    source = target / "source"
    shutil.copytree(staged, source)
    (source / "problems").mkdir(exist_ok=True)
    (source / "problems/index.md").write_text("# Predefined problems\n", encoding="utf-8")
    stage.contents(source, {"Reference": ["problems/index.md", "api/index.rst"]})
    make_site.settings(source)
    assert make_site.build(source, target / "html", target / "trees") is None
    return target / "html"


@pytest.mark.slow
@pytest.mark.filterwarnings("default::DeprecationWarning", "default::PendingDeprecationWarning")
def test_the_search_answers_questions_with_one_of_its_first_three_pages(browser, site) -> None:
    page, asked = browser.new_page(), []
    page.on("request", lambda request: asked.append(request.url))
    links = "[...document.querySelectorAll('#search-results li > a')].map(a => a.href)"
    done = "document.querySelector('.search-summary')?.innerText.includes('inished')"
    for question, answer in QUESTIONS.items():
        page.goto(f"file://{site}/search.html?q={quote(question)}")
        until(page, done)
        found = page.evaluate(links)[:3]
        assert any(f"/docs/{answer}.html" in link for link in found), f"{question}: {found}"
    page.goto(f"file://{site}/index.html", wait_until="networkidle")
    assert all(address.startswith(("file:", "data:", "blob:")) for address in asked)
    page.close()
