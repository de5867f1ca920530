"""The report in a real Chromium, from a file: it opens, sorts, filters, flips, tells values, asks for nothing."""

from __future__ import annotations

import io
import os
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from browser import chromium, complaints, missing, prefer, requests
from PIL import Image
from places import ROOT
from report_folder import HOSTILE, RASTER, SIZE, row, small_folder, write_images

from nusselt.experiments.results.document import document, write_json
from nusselt.experiments.results.report import write_report
from nusselt.experiments.results.report.pixels import BRIEF

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        missing() is not None and not os.environ.get("NUSSELT_NEEDS_BROWSER"),
        reason=f"the report was NOT tried in a browser: {missing()}",
    ),
]


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> str:
    folder = tmp_path_factory.mktemp("report")
    write_report(small_folder(tmp_path_factory.mktemp("folder")), folder / "report.html")
    return (folder / "report.html").as_uri()


@pytest.fixture(scope="module")
def opened(page, tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile") / "p") as browser:
        browser.get(page)
        yield browser


@pytest.fixture
def browser(opened, page):
    """The page as it was when it opened, and the console silent after every test."""
    opened.get("about:blank")
    opened.get(page)
    yield opened
    assert complaints(opened) == []
    assert opened.execute_script("return window.hacked") is None


def find(browser, selector: str):
    return browser.find_element("css selector", selector)


def names(browser) -> list[str]:
    """Scenes shown, in order."""
    return [e.text for e in browser.find_elements("css selector", "#table .open") if e.is_displayed()]


def open_row(browser, scene: str):
    """Unfold a row, wait for its images; returns its viewer."""
    from selenium.webdriver.support.ui import WebDriverWait

    body = next(b for b in browser.find_elements("css selector", "#table tbody") if scene in names_of(b))
    button = body.find_element("css selector", ".open")
    if button.get_attribute("aria-expanded") != "true":
        button.send_keys("\n")
    viewer = body.find_element("css selector", ".viewer")
    WebDriverWait(browser, 10).until(lambda _: viewer.get_attribute("data-ready") == "yes")
    return viewer


def names_of(body) -> list[str]:
    return [body.find_element("css selector", ".open").text]


def pixel(browser, viewer, x: int, y: int) -> list[int]:
    """The colour the canvas shows at a pixel of the image."""
    script = """const c = arguments[0].querySelector('canvas'), s = c.width / 64, top = (c.height - 48 * s) / 2;
    return [(arguments[1] + .5) * s, top + (arguments[2] + .5) * s];"""
    return colour(browser, viewer, *browser.execute_script(script, viewer, x, y))


def colour(browser, viewer, x: float, y: float) -> list[int]:
    """The colour of the canvas at a place of its own, read from a copy."""
    script = """const c = arguments[0].querySelector('canvas'), copy = new OffscreenCanvas(c.width, c.height);
    const context = copy.getContext('2d', { willReadFrequently: true });
    context.drawImage(c, 0, 0);
    return [...context.getImageData(arguments[1], arguments[2], 1, 1).data.slice(0, 3)];"""
    return browser.execute_script(script, viewer, x, y)


def told(viewer) -> str:
    return viewer.find_element("css selector", ".value").get_property("textContent")


def press(viewer, keys: str) -> None:
    viewer.find_element("css selector", "canvas").send_keys(keys)


def test_it_opens_without_a_word_and_asks_for_nothing(page, tmp_path):
    with chromium(tmp_path / "p") as fresh:
        fresh.get(page)
        assert "not as claimed" in find(fresh, "h1").text
        open_row(fresh, "right")
        asked = [address for address in requests(fresh) if not address.startswith("data:")]
        assert asked == [page]
        assert complaints(fresh) == []


def test_the_failing_row_is_first_and_open(browser):
    assert names(browser)[0] == "wrong"
    assert find(browser, "#row-0 .open").get_attribute("aria-expanded") == "true"


def test_filters_by_status_and_by_words(browser):
    assert len(names(browser)) == 3 + len(HOSTILE)
    find(browser, "#filter input[value=all]").send_keys("\ue014")  # the right arrow key
    assert names(browser) == ["wrong"]
    find(browser, "#filter input[value=failing]").send_keys("\ue014")
    assert names(browser) == ["unknown"]
    find(browser, "#filter input[value=undecided]").send_keys("\ue012\ue012")
    find(browser, "#search").send_keys("WINDOW.hacked script")
    assert names(browser) == [HOSTILE[0], HOSTILE[2]]
    assert find(browser, "#shown").text == f"2 of {3 + len(HOSTILE)} shown"
    find(browser, "#search").send_keys(" nothing like it")
    assert names(browser) == []
    assert find(browser, "#none").is_displayed()


def test_sorts_by_numbers_and_by_names_and_back(browser):
    def press_header(label):
        header = next(b for b in browser.find_elements("css selector", "th button") if b.text.startswith(label))
        header.send_keys("\n")
        return header.find_element("xpath", "..").get_attribute("aria-sort")

    assert press_header("Bias") == "ascending"
    assert names(browser)[0] == HOSTILE[0]
    assert names(browser)[-2:] == ["wrong", "unknown"]  # nothing measured is last
    assert press_header("Bias") == "descending"
    assert names(browser)[0] == "wrong"
    assert names(browser)[-1] == "unknown"
    press_header("Scene")
    shown = names(browser)
    assert shown.index("right") < shown.index("unknown") < shown.index("wrong")


def test_flips_between_ours_and_the_reference(browser):
    viewer = open_row(browser, "right")
    ours = pixel(browser, viewer, 60, 40)
    expected = 255 * np.clip(RASTER[:, 40, 60], 0, 1)
    np.testing.assert_allclose(ours, expected, atol=1.5)
    press(viewer, "f")
    assert viewer.find_element("css selector", "input[value=reference]").is_selected()
    press(viewer, "f")
    assert viewer.find_element("css selector", "input[value=ours]").is_selected()
    assert pixel(browser, viewer, 60, 40) == ours


def test_shows_the_difference_in_colours_and_what_is_not_finite_in_magenta(browser):
    viewer = open_row(browser, "wrong")
    assert pixel(browser, viewer, 7, 5) == [255, 0, 255]
    press(viewer, "d")
    assert viewer.find_element("css selector", ".legend").is_displayed()
    red, _, blue = pixel(browser, viewer, 30, 30)
    assert red > blue + 50  # +5 standard errors
    press(viewer, "t")
    assert viewer.find_element("css selector", "input[value=tiles]").is_selected()


def test_exposure_doubles_a_stop(browser):
    viewer = open_row(browser, "right")
    before = np.array(pixel(browser, viewer, 5, 5))
    press(viewer, "ee")
    assert viewer.find_element("css selector", ".exposure output").text == "+1.00"
    np.testing.assert_allclose(pixel(browser, viewer, 5, 5), 2 * before, atol=2)
    press(viewer, "EEEE")
    np.testing.assert_allclose(pixel(browser, viewer, 5, 5), before / 2, atol=2)


def test_tells_the_value_under_the_pointer(browser):
    from selenium.webdriver import ActionChains

    viewer = open_row(browser, "right")
    canvas = viewer.find_element("css selector", "canvas")
    browser.execute_script("arguments[0].scrollIntoView({ block: 'center' })", canvas)
    scale = canvas.size["width"] / SIZE[1]
    x, y = 20, 30
    at = ((x + 0.5) * scale - canvas.size["width"] / 2, (y + 0.5) * scale - canvas.size["height"] / 2)
    ActionChains(browser).move_to_element_with_offset(canvas, *map(int, at)).perform()
    words = told(viewer)
    assert words.startswith(f"x {x}, y {y} ")
    ours = [float(w) for w in words.split("ours")[1].split("reference")[0].split()]
    np.testing.assert_allclose(ours, RASTER[:, y, x], rtol=2 ** -(BRIEF.bits + 1) + 5e-4)
    assert "standard errors" in words
    assert ", p 0." in words


def test_arrow_keys_point_and_zoom_keeps_the_pixel(browser):
    viewer = open_row(browser, "right")
    press(viewer, "\ue014\ue015")
    assert told(viewer).startswith("x 33, y 25 ")
    press(viewer, "+++++")
    size = browser.execute_script("const c = arguments[0].querySelector('canvas'); return [c.width, c.height]", viewer)
    shown = colour(browser, viewer, size[0] / 2, size[1] / 2)
    np.testing.assert_allclose(shown, 255 * np.clip(RASTER[:, 25, 33], 0, 1), atol=1.5)
    press(viewer, "0")
    assert told(viewer).startswith("x 33, y 25 ")


def test_everything_is_reached_by_the_keyboard_and_has_a_name(browser):
    script = """return [...document.querySelectorAll('button, input, canvas, pre')].filter((e) => e.tabIndex < 0 || !(
      e.textContent.trim() || e.getAttribute('aria-label') || e.labels?.length)).map((e) => e.outerHTML)"""
    assert browser.execute_script(script) == []
    assert browser.execute_script("return [...document.images].filter((i) => i.alt === null).length") == 0


@pytest.mark.parametrize("dark", [False, True])
def test_ink_stands_out_from_paper_in_dark_and_in_light(browser, dark):
    """WCAG's contrast of body text and of every quiet word, 4.5 and more."""
    script = """const linear = (v) => v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4;
    const lum = (c) => { const [r, g, b] = c.match(/[\\d.]+/g).map(linear); return .2126 * r + .7152 * g + .0722 * b; };
    const paper = lum(getComputedStyle(document.body).backgroundColor);
    const words = ['body', '.quiet', '.badge.as-claimed', '.badge.undecided', 'dt', 'figcaption', '.plot text'];
    return [paper, words.map((s) => { const ink = lum(getComputedStyle(document.querySelector(s)).color);
      return (Math.max(ink, paper) + 0.05) / (Math.min(ink, paper) + 0.05); })];"""
    prefer(browser, dark)
    paper, contrasts = browser.execute_script(script)
    prefer(browser, False)
    assert (paper < 0.05) == dark
    assert min(contrasts) >= 4.5, contrasts


@pytest.mark.parametrize("verdict", [("agrees", True), ("undecided", None), ("differs", False)])
def test_the_first_line_is_the_largest_whatever_it_says(verdict, opened, tmp_path):
    write_json(document([row("a", *verdict)]), str(tmp_path / "results.json"))
    write_report(tmp_path, tmp_path / "page.html")
    opened.get((tmp_path / "page.html").as_uri())
    script = """return [...document.querySelectorAll('h1, h2, dt, dd strong')].map(
      (e) => parseFloat(getComputedStyle(e).fontSize));"""
    sizes = opened.execute_script(script)
    assert sizes[0] > 1.5 * max(sizes[1:])


@contextmanager
def width_of(browser, pixels: int):
    metrics = {"width": pixels, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    yield
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_it_fits_a_telephone(browser):
    with width_of(browser, 390):
        assert browser.execute_script("return document.documentElement.scrollWidth") <= 390


VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'


def test_choices_and_long_numbers_stay_inside_a_telephone(opened, tmp_path):
    views = "".join(f"<label><input type=radio><span>{word}</span></label>" for word in ("With mistake",) * 6)
    body = f'<main><fieldset class="choice views">{views}</fieldset><p><code>{"0123456789abcdef" * 6}</code></p></main>'
    style = (ROOT / "experiments/results/report/style.css").read_text(encoding="utf-8")
    (tmp_path / "page.html").write_text(f"{VIEWPORT}<style>{style}</style>{body}", encoding="utf-8")
    with width_of(opened, 390):
        opened.get((tmp_path / "page.html").as_uri())
        script = """return [document.documentElement.scrollWidth,
          Math.max(...[...document.querySelectorAll('.choice span')].map((e) => e.getClientRects()[0].right)),
          Math.max(...[...document.querySelectorAll('.choice span')].map((e) => e.getClientRects()[0].height))];"""
        width, right, height = opened.execute_script(script)
    assert max(width, right) <= 390
    assert height < 40, "words of a choice on two lines"


@pytest.mark.parametrize("pixels", [420, 1000])
def test_words_are_whole_and_figures_inside_at_any_width(pixels, opened, tmp_path):
    names = ["quad-stratified", "cornell-glossy", "unshadowed"]
    write_json(document([row(name, noise_word="as expected") for name in names]), str(tmp_path / "results.json"))
    write_report(tmp_path, tmp_path / "page.html")
    with width_of(opened, pixels):
        opened.get((tmp_path / "page.html").as_uri())
        broken = """const broken = [];
        const words = document.createTreeWalker(document.getElementById("table"), NodeFilter.SHOW_TEXT);
        while (words.nextNode()) for (const word of words.currentNode.data.matchAll(/[a-z]+/gi)) {
          const range = document.createRange();
          range.setStart(words.currentNode, word.index);
          range.setEnd(words.currentNode, word.index + word[0].length);
          if (new Set([...range.getClientRects()].map((box) => Math.round(box.top))).size > 1) broken.push(word[0]);
        }
        return broken"""
        assert opened.execute_script(broken) == []
        outside = """const right = document.querySelector(".wide").getBoundingClientRect().right;
        return [...document.querySelectorAll(".line td")].filter((e) => e.getBoundingClientRect().right > right + 1
          ).map((e) => e.textContent)"""
        assert opened.execute_script(outside) == []
        bias = opened.execute_script("return document.querySelector('[data-head=bias]').getBoundingClientRect().width")
        assert bias > 30


def test_a_hostile_figure_is_a_picture(browser):
    figure = find(browser, ".figures img")
    assert Path(figure.get_attribute("alt")).name == "slopes"
    assert figure.get_attribute("src").startswith("data:image/svg+xml;base64,")


def test_a_row_shows_the_figure_that_its_scene_shares(browser):
    open_row(browser, "right")
    drawing = find(browser, "#row-1 .across svg, #row-2 .across svg")
    area = browser.execute_script("const b = arguments[0].getBoundingClientRect(); return b.width * b.height", drawing)
    assert area > 20_000
    picture = np.array(Image.open(io.BytesIO(drawing.screenshot_as_png)).convert("RGB")).astype(int)
    coloured = (picture.max(axis=2) - picture.min(axis=2) > 60).mean()
    assert coloured > 1e-3  # the shared drawing is there, not an empty frame


def test_what_was_brought_is_called_yours(tmp_path):
    images = write_images(tmp_path, "a", RASTER, RASTER * 1.001, RASTER[0])
    images = {name.replace("ours", "brought"): path for name, path in images.items()}
    write_json(document([row("a", "differs", False, images=images, brought=["a.png"])]), str(tmp_path / "results.json"))
    write_report(tmp_path, tmp_path / "page.html")
    with chromium(tmp_path / "p") as fresh:
        fresh.get((tmp_path / "page.html").as_uri())
        viewer = open_row(fresh, "a")
        press(viewer, "\ue014")
        assert " yours " in told(viewer)
        assert "ours − reference" not in viewer.text
        assert [label.text for label in viewer.find_elements("css selector", ".views span")][:3] == [
            *("Yours", "Reference", "Difference"),
        ]
        assert complaints(fresh) == []
