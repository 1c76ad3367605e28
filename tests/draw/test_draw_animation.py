"""Animations: frames, closed loops, files, and the command."""

import base64
import io
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import mechdae as md
from mechdae.cli import main
from mechdae.draw import save
from mechdae.draw.animation import animate
from mechdae.draw.diagram.scene import read_scene


@pytest.fixture(scope="module")
def turn():
    return md.solve("four-bar-crank-rocker", "turn", poses=13)


def test_a_closed_motion_is_shown_once_around(turn):
    moving = animate(turn)
    assert moving.closed
    assert moving.poses == tuple(range(12))  # the 13th pose is the first
    assert animate(turn, frames=6).poses == (0, 2, 4, 6, 8, 10)
    steps = np.diff([*animate(turn, frames=5).poses, 12])
    assert set(steps.tolist()) <= {2, 3}


def test_an_open_motion_runs_to_and_fro():
    result = md.solve("four-bar-double-rocker", "window", poses=9)
    moving = animate(result)
    assert not moving.closed
    assert moving.poses[: len(moving) // 2 + 1] == tuple(range(len(moving) // 2 + 1))
    assert moving.poses == (*range(9), *range(7, 0, -1))


def test_a_turn_of_wheels_that_do_not_come_back_is_not_closed():
    mechanism = md.load("planetary-gear-loads").mechanism
    driver = md.Driver("sun.angle", from_=0.0, to=2 * np.pi)
    result = md.solve(mechanism, md.Sweep(driver, poses=9))
    scene = read_scene(result)
    assert not scene.closes(scene.assembled())


def test_gif_has_all_frames_of_one_size(turn, tmp_path):
    seen = []
    path = animate(turn, frames=4, seconds=2.0, dpi=50).save(
        tmp_path / "a.gif", lambda done, total: seen.append((done, total))
    )
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    with Image.open(path) as picture:
        assert picture.n_frames == 4
        assert picture.size == (350, 250)
        assert picture.info["loop"] == 0
        assert picture.info["duration"] == 500
        rows = []
        for k in range(4):
            picture.seek(k)
            rows.append(np.asarray(picture.convert("RGB")).copy())
    assert all((rows[0] != row).any() for row in rows[1:])
    assert path.stat().st_size < 60_000
    assert len(list(tmp_path.iterdir())) == 1


def test_files_are_the_same_each_time(turn, tmp_path):
    moving = md.plot(turn, "animation", frames=3, dpi=40)
    first, second = (save(moving, tmp_path / name) for name in ("a.gif", "b.gif"))
    assert first.read_bytes() == second.read_bytes()
    with pytest.raises(md.InputError, match="gif"):
        save(moving, tmp_path / "a.png")


def test_the_ground_stands_still(turn):
    """What is fixed is at the same place of every frame: below the mechanism nothing moves."""
    frames = [
        np.asarray(f.convert("RGB")) for f in animate(turn, frames=4, dpi=50, labels=False).frames()
    ]
    strip = [frame[225:] for frame in frames]  # scale bar
    assert all((strip[0] == other).all() for other in strip[1:])


def test_in_a_notebook(turn):
    html = animate(turn, frames=2, dpi=40)._repr_html_()
    data = html.split("base64,")[1].split('"')[0]
    with Image.open(io.BytesIO(base64.b64decode(data))) as picture:
        assert picture.format == "GIF"


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"frames": 1}, "frames"),
        ({"frames": 601}, "frames"),
        ({"seconds": 0.0}, "round"),
        ({"dpi": 1000}, "dpi"),
        ({"ax": 1}, "figure of its own"),
    ],
)
def test_numbers_out_of_range(turn, options, match):
    with pytest.raises(md.InputError, match=match):
        md.plot(turn, "animation", **options)


def test_what_does_not_move():
    with pytest.raises(md.InputError, match="no motion"):
        md.plot(md.solve("four-bar-crank-rocker", "modes"), "animation")


def test_the_command(tmp_path, capsys):
    words = ["plot", "four-bar-double-rocker", "--out", str(tmp_path)]
    assert main([*words, "--kind", "animation", "--pose", "2"]) == 2
    assert main([*words, "--kind", "animation", "--format", "png"]) == 2
    assert main([*words, "--lang", "de"]) == 2
    assert "en or ru" in capsys.readouterr().err
    assert main([*words, "--lang", "ru", "--dark"]) == 0
    out = capsys.readouterr()
    assert out.out.strip().endswith("-diagram.svg")
    assert not out.err


def test_an_svg_moves_by_itself(tmp_path):
    """Each frame is seen for its time, one at each moment; no script; the same bytes each time."""
    result = md.solve("slider-crank", "turn")
    moving = md.plot(result, "animation", frames=8)
    text = moving.save(tmp_path / "a.svg").read_text(encoding="utf-8")
    assert text == moving.svg()
    assert "<script" not in text
    root = ElementTree.fromstring(text)
    seen = []
    for own in root.iter("{http://www.w3.org/2000/svg}animate"):
        times = [float(value) for value in own.get("keyTimes").split(";")]
        values = own.get("values").split(";")
        moments = (np.arange(8) + 0.5) / 8
        seen.append([values[np.searchsorted(times, t, side="right") - 1] for t in moments])
    assert (np.array(seen) == "visible").sum(axis=0).tolist() == [1] * 8
    used = {own.get("{http://www.w3.org/1999/xlink}href") for own in root.iter()} - {None}
    known = {f"#{own.get('id')}" for own in root.iter() if own.get("id")}
    assert used <= known
    assert len(text) < 150_000


def test_films_need_ffmpeg(tmp_path, monkeypatch):
    moving = md.plot(md.solve("slider-crank", "turn"), "animation", frames=3)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(md.UnavailableError, match="ffmpeg, which is not installed"):
        moving.save(tmp_path / "a.mp4")
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\n/bin/cat > "$last"\n', encoding="utf-8")
    program.chmod(0o755)
    film = moving.save(tmp_path / "b.webm")
    assert film.stat().st_size == 3 * 700 * 500 * 3  # what it was given: three frames of pixels
    program.write_text(
        "#!/bin/sh\n/bin/cat > /dev/null\necho no codec >&2\nexit 1\n", encoding="utf-8"
    )
    with pytest.raises(md.UnavailableError, match="no codec"):
        moving.save(tmp_path / "c.mp4")
    assert not list(tmp_path.glob(".*.part*"))
    with pytest.raises(md.InputError, match="not written as"):
        moving.save(tmp_path / "a.avi")
