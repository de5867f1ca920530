"""The report's page as text: what is in it, what cannot get into it, how large it is."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
import zlib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from report_folder import HOSTILE, RASTER, row, small_folder, timed, write_images
from test_cli import run

from nusselt.experiments.results.document import document, write_json
from nusselt.experiments.results.report import page as page_module
from nusselt.experiments.results.report import write_report
from nusselt.experiments.results.report.figures import BUDGET as FIGURES
from nusselt.experiments.results.report.pixels import (
    BRIEF,
    PRECISE,
    averaged,
    averaged_difference,
    encode,
    normaliser,
    pack_all,
    total_size,
)
from nusselt.experiments.results.report.plots import error_figure
from nusselt.experiments.results.summary import facts, headline
from nusselt.experiments.results.work_precision import curves, races, seconds_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return small_folder(tmp_path_factory.mktemp("folder"))


@pytest.fixture(scope="module")
def page(folder, tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("page") / "report.html"
    assert write_report(folder, path) == 17
    return path.read_text(encoding="utf-8")


class Elements(HTMLParser):
    """Every element with its attributes, and which were left open."""

    VOID = ("meta", "link", "img", "input", "br")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict]] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_well_formed_and_every_name_is_its_own(page):
    elements = Elements(page)
    assert elements.open == []
    names = [attributes["id"] for _, attributes in elements.found if "id" in attributes]
    assert len(names) == len(set(names))


def test_nothing_in_the_page_leads_out_of_it(page):
    for tag, attributes in Elements(page).found:
        for name in ("src", "href", "xlink:href", "action"):
            target = attributes.get(name, "#")
            assert target.startswith(("#", "data:")), (tag, target)
    assert "default-src 'none'" in page
    assert "@import" not in page
    assert "url(http" not in page


def test_hostile_names_are_text(page):
    for tag, attributes in Elements(page).found:
        assert tag != "script" or attributes.get("type") in (None, "text/plain", "application/json")
        assert not any(name.startswith("on") for name in attributes)
    assert page.count("<script>") == 1
    assert "{{ 7 * 7 }}" in page
    assert "&lt;script&gt;window.hacked=1" in page


def test_the_first_line_is_the_verdict(page):
    heading = re.search("<h1.*?</h1>", page, re.DOTALL).group()
    assert "1 of 8 rows is not as claimed, 1 undecided" in heading


def test_the_page_depends_on_the_folder_alone(folder, page, tmp_path):
    write_report(folder, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == page


def test_images_outside_the_folder_are_not_read(tmp_path):
    inner = tmp_path / "inner"
    entry = row("a")
    entry["images"] = write_images(tmp_path, "outside", RASTER, RASTER, RASTER[0])
    entry["images"] = {name: f"../{path}" for name, path in entry["images"].items()}
    write_json(document([entry]), str(inner / "results.json"))
    write_report(inner, tmp_path / "page.html")
    assert "are not in the folder" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_the_command_refuses_what_is_no_folder_of_results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("empty").mkdir()
    Path("bad").mkdir()
    Path("bad/results.json").write_text("{")
    for name in ("gone", "empty", "bad"):
        status, said, error = run("report", name, "-o", "page.html")
        assert (status, said) == (2, "")
        assert name in error
    assert not Path("page.html").exists()


@pytest.mark.parametrize("more", [{}, {"reference": {}}, {"images": None}, {"pixels": {}}, {"bias_interval": [0, 1]}])
@pytest.mark.parametrize("verdict", [{}, {"verdict": "agrees"}])
def test_rows_of_few_figures_are_shown(more, verdict, tmp_path):
    few = {"experiment": "stability", "as_claimed": True} | verdict | more
    write_json(document([few]), str(tmp_path / "results.json"))
    write_report(tmp_path, tmp_path / "page.html")
    assert "stability" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_no_rows_are_a_failure_that_says_so(tmp_path):
    write_json(document([]), str(tmp_path / "results.json"))
    assert run("report", tmp_path, "-o", tmp_path / "page.html")[0] == 1
    assert "Nothing was measured" in (tmp_path / "page.html").read_text(encoding="utf-8")


def decoded(blob: bytes, exponent: int, shape: tuple[int, ...]) -> np.ndarray:
    """What the page's script makes of a blob."""
    planes = np.frombuffer(zlib.decompress(blob), np.uint8).astype(np.uint16).reshape(2, -1)
    halves = (planes[0] << 8 | planes[1]).view(np.float16).astype(float)
    return np.ldexp(halves, exponent).reshape(shape)


@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1.0, 1e6, 1e30])
def test_radiance_comes_back_to_eleven_bits_at_any_scale(scale):
    layer = np.random.default_rng(0).uniform(1e-4, 1, (3, 20, 30)) * scale
    exponent = normaliser(layer)
    again = decoded(encode(layer, exponent), exponent, layer.shape)
    np.testing.assert_allclose(again, layer, rtol=2**-11)
    coarse = decoded(encode(layer, exponent, bits=5), exponent, layer.shape)
    np.testing.assert_allclose(coarse, layer, rtol=2**-6 + 2**-11)


def test_what_is_not_finite_stays_so():
    layer = np.array([[[np.nan, np.inf, -np.inf, 1.0, 0.0]]])
    again = decoded(encode(layer, normaliser(layer), bits=5), normaliser(layer), layer.shape)
    np.testing.assert_array_equal(again, layer)


def test_blocks_are_means_also_where_they_do_not_fill_the_edge():
    layer = np.arange(3 * 5 * 7, dtype=float).reshape(3, 5, 7)
    small = averaged(layer, 2)
    assert small.shape == (3, 3, 4)
    assert small[1, 0, 0] == pytest.approx(layer[1, :2, :2].mean())
    assert small[2, 2, 3] == layer[2, 4, 6]
    assert small[0, 1, 3] == pytest.approx(layer[0, 2:4, 6].mean())


def test_the_difference_of_blocks_is_still_in_standard_errors():
    """Null data: 4 x 4 blocks of unit normal differences, each pixel with its own known error; chi-square at 1e-6."""
    from scipy import stats

    rng = np.random.default_rng(2)
    sigma = rng.uniform(0.5, 2, (1, 402, 402))
    z = rng.normal(size=sigma.shape)
    found = averaged_difference(z, z * sigma, 4)
    square = float((found**2).sum())
    assert stats.chi2.isf(1 - 5e-7, found.size) < square < stats.chi2.isf(5e-7, found.size)


def test_images_that_are_too_large_are_made_coarser_until_they_fit():
    layers = {"ours": np.random.default_rng(3).random((3, 64, 64)), "reference": np.ones((3, 64, 64))}
    whole = pack_all([lambda: layers, None], PRECISE)
    assert whole[1] is None
    assert whole[0].info["factor"] == 1
    third = dataclasses.replace(PRECISE, budget=total_size(whole) // 3)
    half = pack_all([lambda: layers, lambda: layers], third)
    assert {packed.info["factor"] for packed in half} == {2}
    assert total_size(half) <= total_size(whole) // 3
    assert pack_all([lambda: layers], dataclasses.replace(BRIEF, budget=10)) == [None]
    assert total_size(pack_all([lambda: layers], BRIEF)) < 0.75 * total_size(whole)


def test_rows_of_one_reference_share_its_bytes():
    layers = {"ours": np.ones((3, 8, 8)), "reference": np.random.default_rng(4).random((3, 8, 8))}
    one, two = pack_all([lambda: layers], BRIEF), pack_all([lambda: layers, lambda: layers], BRIEF)
    assert total_size(one) == total_size(two)


def test_the_page_keeps_to_its_size(monkeypatch, tmp_path):
    """With a twentieth of the budget: images and figures keep to it, and the rest is small; 60 rows leave room."""
    budget = PRECISE.budget // 20
    monkeypatch.setattr(page_module, "PRECISE", dataclasses.replace(PRECISE, budget=budget))
    rng = np.random.default_rng(5)
    noisy = rng.random((3, 240, 320)) + 0.5
    rows = [row("big") | {"images": write_images(tmp_path, "big", noisy, noisy[::-1], rng.normal(size=(240, 320)))}]
    rows += [row(f"scene {k}") for k in range(9)]
    write_json(document(rows, alpha=1e-3), str(tmp_path / "results.json"))
    for k in range(4):
        (tmp_path / f"figure-{k}.png").write_bytes(rng.bytes(700_000))
    write_report(tmp_path, tmp_path / "page.html", precise=True)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    images = sum(map(len, re.findall(r'<script type="text/plain" id="p[0-9a-f]{16}">([^<]+)</script>', page)))
    figures = sum(map(len, re.findall(r'<img src="data:image/png;base64,([^"]+)"', page)))
    rest = len(page) - images - figures
    assert "mean of 2 × 2" in page
    assert 0 < images <= budget * 4 / 3
    assert figures > 0
    assert images + figures <= (budget + FIGURES) * 4 / 3 + 100
    assert "beside it in the folder: figure-1.png, figure-2.png, figure-3.png" in page
    assert PRECISE.budget * 4 / 3 + FIGURES * 4 / 3 + 6 * rest < 15e6
    assert BRIEF.budget * 4 / 3 + rest / 10 * 16 < 3e6  # a page of 16 rows and no figures


def test_rows_of_one_scene_share_their_figure(tmp_path):
    """A row more costs its words and its histogram, not another drawing of the same curves (50 KB)."""
    points = [line for k in range(8) for line in timed("right", "ours", f"way {k}", 0.01 + k)]
    sizes = []
    for count in (10, 40):
        rows = [row("right", estimator=f"way {k % 10}", stratified=False) for k in range(count)]
        write_json(document([*rows, *points], alpha=1e-3), str(tmp_path / "results.json"))
        write_report(tmp_path, tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        sizes.append(len(page))
    assert page.count('<svg id="errors-0"') == 1
    assert page.count('<use href="#errors-0"') == 40
    assert [page.count(f'style="--{k}: 2.4"') for k in range(10)] == [4] * 8 + [0, 0]  # 8 curves are drawn
    assert (sizes[1] - sizes[0]) / 30 < 25_000


def test_how_fast_is_told_by_the_race_alone():
    """Rows of other experiments have seconds too, taken at other times under other conditions."""
    raced = {"experiment": "error-against-time", "scene": "a", "pixel_rule": "area", "target": 1e-3, "ratio": 3.0}
    raced |= {"ours": {"estimator": "exact", "seconds": 1.0}, "lower_bound_only": True}
    raced |= {"mitsuba": {"configuration": "emitter, ldsampler", "seconds": 3.0, "extrapolated": True}}
    (race,) = races([raced, raced | {"target": 1e-2}, raced | {"ratio": None}])
    assert (race.scene, race.ratio, race.bound) == ("a, area", 3.0, True)
    assert race.mitsuba == ("Mitsuba emitter, ldsampler", 3.0, True)
    assert "3 × as fast" in {fact.answer for fact in facts(document([raced]))}
    assert not races([*timed("a", "ours", "area", 0.01), *timed("a", "mitsuba", "direct", 0.03), row("a")])


def test_seconds_are_of_one_image_however_they_are_told():
    assert seconds_of({"seconds": {"ours": 8.0}, "passes": 4}) == 2
    assert seconds_of({"seconds": {"median": 3.0}}) == 3
    assert seconds_of({"seconds": [1.0, 5.0, 2.0]}) == 2
    assert seconds_of({"seconds": None}) is None


def test_points_without_noise_of_their_own_make_no_curve():
    below = row("a") | {"mse_relative": 1e-9, "mse_relative_standard_error": 1e-6}
    above = row("a") | {"mse_relative": 1e-4, "mse_relative_standard_error": 1e-6}
    assert not curves([below], "a")
    assert curves([above], "a")[0].points[0].error == pytest.approx(1e-2)


def test_an_error_figure_needs_two_numbers_of_samples_and_has_whole_decades():
    alike = [timed("a", "ours", "area", scale)[1] for scale in (0.195, 0.2)]
    assert error_figure(curves(alike, "a"), "x") is None
    near = [line | {"seconds": {"median": 0.78 + 0.002 * line["samples"]}} for line in timed("a", "ours", "area", 1)]
    words = re.findall(r"<text[^>]*>(.*?)</text>", error_figure(curves(near, "a"), "x").svg, flags=re.DOTALL)
    assert words
    assert not any("×" in word for word in words)


@pytest.mark.parametrize(
    ("rows", "tone", "said"),
    [
        ([], "bad", "Nothing was measured"),
        ([timed("a", "ours", "area", 1)[0]], "bad", "Nothing was measured"),
        ([row("a")], "good", "The one row agrees with Mitsuba 3.9.1"),
        ([row("a"), row("b", "differs", True)], "good", "All 2 rows are as claimed"),
        ([row("a"), row("b", "differs", False)], "bad", "1 of 2 rows is not as claimed"),
        ([row("a", "differs", False)], "bad", "The one row is not as claimed"),
        ([row("a", "undecided", None)], "open", "The one row is undecided"),
        ([row("a"), row("b", "undecided", None)], "open", "1 of 2 rows undecided"),
    ],
)
def test_the_headline_is_the_worst_that_is_true(rows, tone, said):
    found = headline(rows)
    assert found[0] == tone
    assert said in found[1]
    assert len(facts(document(rows))) == 5


def test_blobs_are_base64_of_what_was_packed(page):
    blobs = re.findall(r'<script type="text/plain" id="p[0-9a-f]{16}">([^<]+)</script>', page)
    assert len(blobs) == 5  # one image is ours in a row and the reference in another
    for text in blobs:
        assert len(zlib.decompress(base64.b64decode(text))) in (2 * 3 * 48 * 64, 2 * 48 * 64)


def test_hostile_names_are_all_there(page):
    assert page.count('class="open"') == 3 + len(HOSTILE)


def test_planted_defects_say_nothing_of_the_renderer():
    from nusselt.experiments.results.summary import facts

    right = {"scene": "quad", "verdict": "agrees", "as_claimed": True, "minimum_detectable_bias": 1e-3}
    planted = {"scene": "quad", "defect": "gain", "verdict": "differs", "as_claimed": True, "bias_relative": 0.1}
    found = {fact.question: fact for fact in facts({"rows": [right, planted | {"minimum_detectable_bias": 0.5}]})}
    assert "Of 1 image" in found["Is the renderer right?"].detail
    assert found["How sure?"].answer == "It finds 0.10 % bias"
    assert found["Where does it differ?"].answer != "Only where it says so"


def test_what_was_not_run_says_nothing_of_what_agrees():
    late = {"experiment": "error-against-time", "scene": "mesh", "as_claimed": None, "note": "not run"}
    biased = {"experiment": "variance-table", "scene": "quad", "estimator": "analytic", "bias_relative": 0.18}
    found = facts(document([row("a"), late, biased | {"as_claimed": True}]))
    assert (found[0].answer, found[0].tone) == ("Yes", "good")
    assert "+0.010 %" in found[4].detail
    assert facts(document([row("a", "undecided", None), late]))[0].answer == "Not known yet"


def test_rows_without_a_verdict_stand_with_their_experiment(tmp_path):
    claims = [{"experiment": "stability", "name": f"case {k}", "as_claimed": k != 3} for k in range(20)]
    write_json(document([row("right"), *claims]), str(tmp_path / "results.json"))
    write_report(tmp_path, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count('class="open"') == 2  # the one compared, and the one that is not as claimed
    assert "19 rows" in page
    assert "case 19" in page


def test_rows_without_a_scene_are_named_by_what_they_are_about():
    from nusselt.experiments.results.rows import figures, subject

    assert subject({"light": "needle", "disk_area": 0.1}) == "needle"
    assert subject({"scene": "quad", "pixel_rule": "area", "target": 1e-3}) == "quad, area, 0.001"
    assert subject({"defect": "gain", "scene": "open floor"}) == "gain, open floor"
    assert figures({"scene": "quad", "ratio": 3.14159265, "held": True, "raw": [1]}) == [
        ("ratio", "3.14159"),
        ("held", "yes"),
    ]


def test_claims_without_a_verdict_are_no_verdict():
    """Rows of experiments that judge no image, one of them with a bias that it claims."""
    rows = [{"experiment": "stability", "name": f"case {k}", "as_claimed": True} for k in range(3)]
    biased = {"experiment": "variance-table", "scene": "quad", "estimator": "analytic", "bias_relative": 0.17}
    found = facts(document([*rows, biased | {"claim": "biased", "as_claimed": True}]))
    assert (found[0].answer, found[0].tone) == ("Not judged", "plain")
    assert found[0].detail.startswith("All 4 rows are as claimed.")
    assert (found[4].answer, found[4].tone) == ("Not judged", "plain")
    assert "+17.000 %, in variance-table: quad analytic, which claims to be biased" in found[4].detail
    undecided = facts(document([row("a", "undecided", None)]))[4]
    assert (undecided.answer, undecided.tone) == ("Not known yet", "open")


def test_the_noise_and_what_would_have_been_found_stand_in_the_row(tmp_path):
    finds = {"contrast": 0.0123, "rms": 0.0456, "pixel": None}
    told = row("a", noise_word="noisier", variance_ratio=3.14159, noise_alike=0.25, pixels_off=2, finds=finds)
    write_json(document([told, row("b", finds=None, noise_word=None)]), str(tmp_path / "results.json"))
    write_report(tmp_path, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count(">noisier</td>") == 1
    assert "bias 0.17 %, contrast 1.23 %, residual (RMS) 4.56 %</dd>" in page
    assert "noisier, 3.14 times the expected variance, correlation 0.25" in page
    assert "2 beyond any noise" in page
    assert page.count("<dt>finds</dt><dd>bias") == 1


def test_what_was_brought_is_shown_with_its_mistakes(tmp_path):
    """A renderer that is a tenth too bright, through the call and the report; its truth is a closed form."""
    import nusselt

    scene = nusselt.read_scene("quad").with_(width=48, height=36)

    def bright(made, samples, seed):
        return 1.1 * nusselt.render(made, estimator="area", samples=samples, seed=seed).array

    results = nusselt.check(scene, renderer=bright, samples=16, margin=0.02, steps=1)
    results.write(tmp_path)
    images = json.loads((tmp_path / "results.json").read_text())["rows"][0]["images"]
    assert {"brought_exr", "reference_exr", "difference_exr"} <= images.keys()
    write_report(tmp_path, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert len(re.findall(r'<script type="text/plain" id="p[0-9a-f]{16}">', page)) == 4  # and the mistake
    assert "did not fit" not in page
    assert "<span>Yours</span>" in page
    said = page[: page.index('id="words"')].replace('value="ours"', "")
    assert not re.search(r"\b[Oo]urs\b", said)
    assert "<td>gain</td>" in page
    assert "<dd>the exact image (analytic)</dd>" in page
    assert "seed 1, seed 2, seed 3, seed 4" in page
    assert not re.search(r"<dt>seed</dt>|Seed 0", page)


def test_the_footer_is_sentences(tmp_path):
    write_json(document([row("a")], alpha=1e-3), str(tmp_path / "results.json"))
    write_report(tmp_path, tmp_path / "page.html")
    footer = (tmp_path / "page.html").read_text(encoding="utf-8").split("<footer>")[1]
    words = " ".join(re.sub("<[^>]*>", "", footer).split())
    assert re.search(r"written \S+\. Seed 3\. False-alarm rate of the whole report 0\.001\.", words)
