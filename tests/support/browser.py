"""A headless Chromium for tests: what it said on its console and what it asked the network for are kept."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

SWITCHES = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--disable-dev-shm-usage", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars"),
    *("--disable-extensions", "--disable-default-apps", "--force-device-scale-factor=1"),
)


def missing() -> str | None:
    """What a browser test lacks here, or None."""
    lacking = [name for name, path in (("chromium", _chromium()), ("chromedriver", _driver())) if path is None]
    return f"no {' and no '.join(lacking)} on this machine" if lacking else None


def _chromium() -> str | None:
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def _driver() -> str | None:
    return shutil.which("chromedriver")


@contextmanager
def chromium(profile: Path, dark: bool = False, size: tuple[int, int] = (1280, 1000)) -> Iterator[Any]:
    """A browser with a profile of its own.

    Parameters
    ----------
    profile : Path
        A folder that is not there yet.
    """
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    if why := missing():  # or Selenium would go and fetch one
        raise RuntimeError(why)
    options = webdriver.ChromeOptions()
    options.binary_location = str(_chromium())
    for switch in (*SWITCHES, f"--user-data-dir={profile}", f"--window-size={size[0]},{size[1]}"):
        options.add_argument(switch)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    quiet = {**os.environ, "no_proxy": "localhost,127.0.0.1"}
    driver = webdriver.Chrome(options=options, service=Service(_driver(), env=quiet))
    try:
        prefer(driver, dark)
        driver.get("about:blank")
        driver.get_log("performance")  # the browser's own first page
        yield driver
    finally:
        driver.quit()


def prefer(driver: Any, dark: bool) -> None:
    """Have the user prefer dark or light pages."""
    features = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})


def requests(driver: Any) -> list[str]:
    """Addresses the page asked for since the last call."""
    entries = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
    return [e["params"]["request"]["url"] for e in entries if e["method"] == "Network.requestWillBeSent"]


def complaints(driver: Any) -> list[str]:
    """What the console holds since the last call."""
    return [entry["message"] for entry in driver.get_log("browser")]
