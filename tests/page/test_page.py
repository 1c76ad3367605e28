"""The live page: its data, its file, what it refuses; poses solved by its modules in Node.js."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.library import names
from mechdae.parts.page import document, link
from mechdae.parts.page.document import KINDS
from tests.shared.command import run
from tests.shared.live import in_page, places_of
from tests.shared.node import needs_node
from tests.shared.page_data import data_of
from tests.shared.predefined import predefined

WEB = Path(link.__file__).parent / "web"
LIVE = ["four-bar-crank-rocker", "gorshkov-seven-link", "jansen-leg", "four-bar-double-rocker",
        "triad-six-modes", "geared-five-bar", "slider-crank", "oscillating-cylinder",
        "five-bar-robot", "differential", "pantograph", "cam-roller-follower", "wankel-rotor",
        "flyball-governor"]  # fmt: skip


def test_a_page_is_the_same_each_time_and_reads_back(tmp_path):
    first = md.page("four-bar-crank-rocker")
    document._page.cache_clear()
    assert first.html == md.page("four-bar-crank-rocker").html
    file = first.save(tmp_path / "page.html")
    data = {key: value for key, value in first.data.items() if key not in link.STORED}
    assert data_of(file) == json.loads(json.dumps(data))
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


def test_a_page_is_built_once(monkeypatch):
    """The same task again is the same page; with another number, language or unit it is not."""
    first = md.page("four-bar-crank-rocker", units="cm")

    def built(*given):
        raise AssertionError

    monkeypatch.setattr(document, "_followed", built)
    for units in ("cm", ["cm"]):
        assert md.page(md.load("four-bar-crank-rocker"), units=units) is first
    for changed in ({"set": {"a_mm": 41}}, {"lang": "ru"}, {"units": "m"}):
        with pytest.raises(AssertionError):
            md.page("four-bar-crank-rocker", **{"units": "cm", **changed})


def test_a_page_asks_nobody(tmp_path):
    text = md.page("jansen-leg").html
    assert "default-src 'none'" in text
    assert not re.search(r"https?://(?!www\.w3\.org/)", text.split(link.OPENING)[0])
    script = link.unpacked(text)
    assert set(re.findall(r"https?://[^\"'`]*", script)) <= {"http://www.w3.org/2000/svg"}
    assert "innerHTML" not in text + script


@pytest.mark.parametrize(
    ("name", "most"),
    [("jansen-leg", 126_000), ("slider-crank-inertia", 113_000), ("chain-of-four-bars", 175_000)],
)
def test_pages_are_small(name, most):
    """What each page teaches with is in it."""
    assert len(md.page(name).html.encode()) < most


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_no_page_is_larger_than_200_kb(name):
    tasks = predefined(name).tasks.values()
    if any(task.kind in KINDS for task in tasks) and not name.startswith("vector-modules"):
        assert len(md.page(name).html.encode()) <= 200_000


def test_names_from_files_change_nothing(tmp_path):
    evil = '</script><script>alert("1")</script>\u202e<!--'
    problem = md.load("four-bar-crank-rocker")
    problem = md.Problem(problem.mechanism, problem.tasks, name="x", title=evil, source=evil)
    page = md.page(problem)
    assert page.html.count("<script") == md.page("four-bar-crank-rocker").html.count("<script")
    markup = re.sub(r"<script.*?</script>", "", page.html, flags=re.S)
    assert "<script>alert" not in markup
    assert "&lt;script&gt;alert" in markup
    assert data_of(page.save(tmp_path / "p.html"))["title"] == evil


def test_tasks_that_cannot_be_live_say_why():
    for name, words in (
        ("andrews-squeezer", "integrated step by step"),
        ("parallelogram-three-cranks", "redundant"),
    ):
        data = md.page(name).data
        assert data["live"] is False
        assert words in data["reason"]
        assert data["recorded"]["points"]


def test_pages_that_cannot_be(capsys, tmp_path):
    for words, said in (
        (["four-bar-crank-rocker", "--task", "modes"], "sweep, reactions, motion"),
        (["four-bar-crank-rocker", "--lang", "fr"], "en, ru"),
        (["four-bar-crank-rocker", "--out", str(tmp_path / "no" / "page.html")], "no such folder"),
        (["four-bar-crank-rockr"], "did you mean"),
        (["vector-modules-planar"], "no point"),
        (["four-bar-crank-rocker", "--set", "b=5"], "assemble"),
    ):
        code, _, err = run(capsys, "page", *words)
        assert code != 0
        assert said in err
    code, out, _ = run(capsys, "plot", "slider-crank", "--kind", "page", "--out", str(tmp_path))
    assert code == 0
    assert Path(out.strip()).exists()
    assert run(capsys, "plot", "slider-crank", "--kind", "page", "--ghosts", "3")[0] == 2


def test_a_result_has_a_page():
    result = md.solve("four-bar-crank-rocker", "turn")
    data = md.page(result).data
    assert data["live"] is True
    assert data["range"] == [0.0, 2 * np.pi]


def test_a_notebook_shows_it():
    shown = md.page("slider-crank")._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    assert "<script" not in shown


@needs_node
@pytest.mark.parametrize("name", LIVE)
def test_poses_are_those_of_python(name, tmp_path):
    page = md.page(name)
    assert page.data["live"] is True
    result = md.solve(name, page.data["task"])
    rows = np.unique(np.linspace(0, len(result.status) - 1, 25).astype(int))
    places = places_of(page, result)[rows].tolist()
    found = in_page(
        page,
        f"""
const poses = {json.dumps(places)}.map((s) => session.motion.pose(s));
const limits = session.motion.ends.map((e) => e && e.s);
console.log(JSON.stringify({{ test: session.selfTest(), limits,
  poses: poses.map((pose) => ({{ status: pose.status, bound: pose.y && session.motion.bound(pose),
    points: Object.fromEntries(data.entries.filter((e) => e.kind === "points").map((e) =>
      [e.part, [0, 1, 2].map((order) => session.inTime(pose, e.columns, order))])) }})) }}));
""",
        tmp_path,
    )
    assert found["test"] < 0.1
    for wanted, own in zip(page.data["limits"], found["limits"], strict=True):
        assert (wanted is None) == (own is None)
        assert wanted is None or abs(wanted - own) < 1e-9
    ratios = []  # of bounds: at single poses Newton's method may end a step earlier
    for k, pose in zip(rows, found["poses"], strict=True):
        assert pose["status"] == result.status[k]
        if pose["status"] != "ok":
            continue
        ratios.append(pose["bound"]["length"] / result.bound.length[k])
        for order, rate in enumerate(("position", "velocity", "acceleration")):
            series = {ref: np.asarray(getattr(own, rate))[k] for ref, own in result.points.items()}
            size = max(np.abs(value).max() for value in series.values())
            for reference, value in series.items():
                miss = np.abs(np.array(pose["points"][reference][order]) - value).max()
                assert miss <= (1e-13, 1e-13, 1e-12)[order] * size
    assert 0.25 < min(ratios) <= max(ratios) < 4


@needs_node
@pytest.mark.parametrize("name", ["four-bar-crank-rocker", "gorshkov-seven-link", "jansen-leg",
                                  "five-bar-robot", "cam-roller-follower"])  # fmt: skip
def test_changed_dimensions_give_what_python_gives(name, tmp_path):
    """Python assembles each set of numbers anew and sweeps it; the page carries its own branch."""
    page = md.page(name)
    task, sliders = page.data["task"], page.data["sliders"]
    names = [slider["name"] for slider in sliders]
    problem, truths = md.load(name), []
    for row in np.random.default_rng(7).uniform(-1, 1, (12, len(sliders))):
        theta = [own["value"] * (1 + 0.03 * u) for own, u in zip(sliders, row, strict=True)]
        truth = md.solve(problem, task, set=dict(zip(names, theta, strict=True)))
        rows = np.flatnonzero(truth.status == "ok")[5::40]
        places = places_of(page, truth)[rows].tolist()
        truths.append((theta, truth, rows, places))
    found = in_page(
        page,
        f"""
const start = [...session.theta];
const wanted = {json.dumps([[theta, places] for theta, _, _, places in truths])};
console.log(JSON.stringify(wanted.map(([theta, places]) => {{
  const t = session.dimension(theta);
  const poses = places.map((s) => session.motion.pose(s));
  const own = poses.map((pose) => [pose.status, pose.y && session.places_of(pose)]);
  session.dimension(start);
  return [t, own];
}})));
""",
        tmp_path,
    )
    compared = missing = 0
    for (_, truth, rows, _), (t, poses) in zip(truths, found, strict=True):
        for k, (status, points) in zip(rows, poses, strict=True):
            if t < 1 or status != "ok":
                missing += 1
                continue
            for reference, series in truth.points.items():
                miss = np.abs(np.array(points[reference]) - series.position[k]).max()
                assert miss < 1e-9
            compared += 1
    assert missing <= 0.05 * compared


@needs_node
def test_links_never_stretch(tmp_path):
    """Sliders pulled to absurd values end where the branch ends, and every pose shown closes."""
    page = md.page("jansen-leg")
    gaps, moved, unnamed = in_page(
        page,
        """
let seed = 12345;
const random = () => { seed = (1103515245 * seed + 12345) % 2147483648; return seed / 2147483648; };
let worst = 0, moved = 0, unnamed = 0;
for (let k = 0; k < 120; k += 1) {
  const theta = [...session.theta];
  const i = Math.floor(random() * theta.length);
  theta[i] = data.sliders[i].value * (0.2 + 2.5 * random());
  const t = session.dimension(theta);
  moved += t > 0 ? 1 : 0;
  unnamed += t < 1 && !session.reason ? 1 : 0;
  // pins are one point by construction: where a loop does not close, a link is longer
  let lengths = null;
  for (const pose of session.poses.filter((p) => p.y).slice(0, 40)) {
    const places = session.places_of(pose);
    const pointsOf = (body) => Object.keys(places).filter((name) => name.startsWith(`${body}.`));
    const shapes = data.scene.bodies.map(({ name }) => pointsOf(name));
    const now = shapes.flatMap((shape) => shape.slice(1).map((name) => {
      const [a, b] = [places[shape[0]], places[name]];
      return Math.hypot(a[0] - b[0], a[1] - b[1]);
    }));
    lengths = lengths || now;
    now.forEach((own, j) => {
      worst = Math.max(worst, Math.abs(own - lengths[j]) / data.start.scale);
    });
  }
}
console.log(JSON.stringify([worst, moved, unnamed]));
""",
        tmp_path,
    )
    assert gaps < 1e-12  # none is nan either: three sides that make no triangle are refused
    assert moved > 20
    assert unnamed == 0


@needs_node
def test_undo_gives_the_same_numbers_back(tmp_path):
    """With their bounds: a small wheel turns further than those of the file hold for."""
    before, after, again, chosen = in_page(
        md.page("rack-and-pinion"),
        """
const shown = () => {
  const { theta, s, mode, pose, motion } = session;
  return JSON.stringify([theta, s, mode, pose.x && [...pose.x], motion.bound(pose)]);
};
const first = shown(), wheel = data.sliders.findIndex(({ name }) => name === "R");
session.remember(); session.dimension(session.theta.map((v, i) => (i === wheel ? 0.05 * v : v)));
const second = shown();
session.remember();
const chosen = session.choose(data.modes.find((m) => !m.own).label);
session.undo(); session.undo();
const third = shown();
session.undo(false);
console.log(JSON.stringify([first, third, second === shown(), chosen]));
""",
        tmp_path,
    )
    assert before == after
    assert again is True
    assert chosen is True


@needs_node
def test_a_hurried_pose_is_the_one_that_is_followed(tmp_path):
    """Carried alone while the hand moves, and followed when it rests: the same pose and ends."""
    slow, quick, refused = in_page(
        md.page("gorshkov-seven-link"),
        """
const statuses = () => session.poses.map((p) => p.status).join("");
const shown = () => [[...session.pose.x], session.range, statuses()];
const wanted = session.theta.map((v, i) => (i === 1 ? 1.04 * v : v));
const far = session.theta.map((v, i) => (i === 1 ? 9 * v : v));
session.dimension(wanted);
const slow = shown();
session.dimension(data.sliders.map((own) => own.value));
for (const share of [0.3, 0.7, 1]) {
  session.hurry(wanted.map((v, i) => data.sliders[i].value * (1 - share) + share * v));
}
const held = Boolean(session.held) && [...session.pose.x];
const before = [...session.theta];
const refused = session.hurry(far) || JSON.stringify(before) !== JSON.stringify(session.theta);
session.settle();
console.log(JSON.stringify([slow, [held, ...shown()], refused]));
""",
        tmp_path,
    )
    held, after, span, statuses = quick
    assert np.abs(np.array(held) - slow[0]).max() < 1e-13
    assert np.abs(np.array(after) - slow[0]).max() < 1e-13
    assert span == pytest.approx(slow[1], abs=1e-12)
    assert statuses == slow[2]
    assert refused is False


@needs_node
@pytest.mark.parametrize(
    ("problem", "name"), [("four-bar-crank-rocker", "b"), ("wankel-rotor", "e")]
)
def test_the_changed_file_is_what_the_page_shows(problem, name, tmp_path):
    """Also where the file has its lengths in mm."""
    page = md.page(problem)
    before = md.load(problem).mechanism.values()
    text = in_page(
        page,
        f"""
const {{ tomlText }} = await import("{(WEB / "files.js").as_posix()}");
session.dimension(session.theta.map((v, i) => (i === 1 ? 1.01 * v : v)));
console.log(JSON.stringify(tomlText(data.file, data.sliders, session.theta)));
""",
        tmp_path,
    )
    file = tmp_path / "changed.toml"
    file.write_text(text, encoding="utf-8")
    changed = md.load(file).mechanism.values()
    assert changed[name] == 1.01 * before[name]
    first = page.data["sliders"][0]["name"]
    assert changed[first] == before[first]


@needs_node
def test_curves_of_what_turns_evenly_show_no_rounding(tmp_path):
    """The rocker of a parallelogram turns as its crank, at 1 rad/s, and accelerates by nothing."""
    phi, omega, epsilon = in_page(
        md.page("change-point-parallelogram", "arc"),
        f"""
globalThis.WORDS = {{}};
const {{ thingsOf }} = await import("{(WEB / "curves.js").as_posix()}");
const rocker = thingsOf({{ session, data }}).find(({{ parts }}) => parts[0] === "rocker");
console.log(JSON.stringify(rocker.lines.map(({{ values }}) => values())));
""",
        tmp_path,
    )
    assert phi == pytest.approx(np.radians(np.linspace(10, 170, len(phi))).tolist(), abs=1e-12)
    assert omega == pytest.approx([1.0] * len(phi), abs=1e-12)
    assert epsilon == [0] * len(phi)


@needs_node
def test_the_table_of_a_spatial_mechanism_has_all_components(tmp_path):
    """Against what Python solved, also of rates and quaternions."""
    page, truth = md.page("rssr"), md.solve("rssr", "turn")
    text = in_page(
        page,
        f"""
const {{ csvText }} = await import("{(WEB / "files.js").as_posix()}");
console.log(JSON.stringify(csvText(session)));
""",
        tmp_path,
    )
    head, *rows = csv.reader(text.splitlines())
    for kind, part, name, axes in (
        ("points", "rocker.C", "velocity", "xyz"),
        ("bodies", "rocker", "orientation", "wxyz"),
        ("bodies", "rocker", "angular_velocity", "xyz"),
    ):
        wanted = np.array(getattr(truth, kind)[part][name])
        places = [k for k, own in enumerate(head) if own.startswith(f"{kind}/{part}/{name}/")]
        assert [head[k].split(" ")[0][-1] for k in places] == list(axes)
        found = np.array([[float(row[k]) for k in places] for row in rows])
        assert found == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())


IMPORTED = re.compile(r'^import \{([^}]*)\} from "(\.{1,2}/[\w/]+\.js)";', re.M)


def test_imports_are_exported_and_used():
    """Modules become one script: what another one does not have would fail when it is run."""
    texts = {file.resolve(): file.read_text(encoding="utf-8") for file in WEB.rglob("*.js")}
    found = 0
    for file, text in texts.items():
        for imported, other in IMPORTED.findall(text):
            exported = texts[(file.parent / other).resolve()]
            for name in re.findall(r"\w+", imported):
                found += 1
                assert re.search(
                    rf"^export .*\b(const|let|class|function) {name}\b", exported, re.M
                )
                assert len(re.findall(rf"\b{name}\b", text)) > 1, (file.name, name)
    assert found > 200


def names_of(text):
    """Return the names that a module declares on its top level."""
    constants = re.findall(r"^(?:export )?const (?!\{)[^({\n]*;$", text, re.M)
    names = re.findall(r"^(?:export )?(?:const|let|class|(?:async )?function) (\w+)", text, re.M)
    return names + [word for line in constants for word in re.findall(r", (\w+) = ", line)]


@pytest.mark.parametrize("main", link.FRAMES)
def test_modules_have_no_name_twice(main):
    assert "export " not in link.modules(main)
    names = [name for text in link.sources(main).values() for name in names_of(text)]
    assert {"made", "words"} <= set(names)
    assert [name for name, count in Counter(names).items() if count > 1] == []
    assert names_of("export const A = 1, B = 2;\nfunction A() {}\n") == ["A", "A", "B"]
