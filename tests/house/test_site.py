"""The documentation site: what it is made of, what it refuses; ``.ci/run`` builds it whole."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

import mechdae as md
from tests.shared.paths import ROOT, document_pages

sys.path.insert(0, str(ROOT / "docs"))
import make_site
from website import api, problems, stage


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
    assert "Tour <README>" in contents


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
    (tmp_path / "a.html").write_text(text, encoding="utf-8")
    assert bool(make_site.fetched(tmp_path)) == asks


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


def test_a_problem_has_diagram_table_curves_file_and_live_page(tmp_path: Path) -> None:
    names = ["slider-crank", "c1-line6-free", "stewart-gough"]
    assert problems.write(tmp_path, names, workers=1) == ["problems/index.md"]
    text = (tmp_path / "problems/slider-crank.md").read_text(encoding="utf-8")
    for picture in ("diagram", "curves"):
        assert f"](slider-crank-{picture}.svg)" in text
        svg = (tmp_path / f"problems/slider-crank-{picture}.svg").read_text(encoding="utf-8")
        assert svg.startswith("<?xml")
    assert "I(1) -> II.2 RRP(2,3)" in text
    assert "(19 of 361 poses" in text
    assert (ROOT / "problems/slider-crank.toml").read_text(encoding="utf-8").strip() in text
    assert 'loading="lazy" src="../live/slider-crank.html"' in text
    page = (tmp_path / "_live/live/slider-crank.html").read_text(encoding="utf-8")
    assert 'id="mechdae"' in page
    assert not make_site.fetched(tmp_path)
    design = (tmp_path / "problems/c1-line6-free.md").read_text(encoding="utf-8")
    assert "](c1-line6-free-diagram.svg)" in design
    assert "iframe" not in design
    heavy = (tmp_path / "problems/stewart-gough.md").read_text(encoding="utf-8")
    assert "`mechdae page stewart-gough` take some seconds" in heavy
    index = (tmp_path / "problems/index.md").read_text(encoding="utf-8")
    assert index.index("## Motion of linkages") < index.index("## Synthesis")
    assert "| [stewart-gough](stewart-gough.md) |" in index.split("## Mechanisms in space")[1]
