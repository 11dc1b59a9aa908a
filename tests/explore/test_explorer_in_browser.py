"""The explorer in JupyterLab as a person uses it: a notebook opened in Chromium, a slider moved with the keyboard."""

import json
import os
import re
import secrets
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
CELL = """from workbench.files.problem import load_problem
from workbench.explore import explore
explore(load_problem('heave'), state='exploration.json')"""
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on PATH (Debian: apt-get install chromium)"),
]


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Address of a JupyterLab that serves a folder with one notebook; the folder."""
    folder = tmp_path_factory.mktemp("lab")
    cell = {"cell_type": "code", "id": "one", "metadata": {}, "outputs": [], "execution_count": None, "source": CELL}
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    (folder / "explore.ipynb").write_text(
        json.dumps({"cells": [cell], "metadata": kernel, "nbformat": 4, "nbformat_minor": 5})
    )
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    token = secrets.token_hex(16)
    home = tmp_path_factory.mktemp("home")
    env = {**os.environ, "HOME": str(home), "JUPYTER_CONFIG_DIR": str(home), "JUPYTER_DATA_DIR": str(home / "data")}
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", f"--port={port}",
               f"--IdentityProvider.token={token}", f"--ServerApp.root_dir={folder}"]  # fmt: skip
    server = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(120):
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/api?token={token}", timeout=2).close()
                break
            except OSError:
                assert server.poll() is None, "JupyterLab stopped before it answered"
                time.sleep(0.5)
        yield f"http://127.0.0.1:{port}/lab/tree/explore.ipynb?token={token}", folder
    finally:
        server.terminate()
        server.wait(20)


def test_a_slider_moved_with_the_arrow_keys_changes_the_picture_and_is_kept(lab, tmp_path):
    from playwright.sync_api import sync_playwright

    address, folder = lab
    with sync_playwright() as player:
        browser = player.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1600, "height": 1100})
        page.goto(address)
        page.wait_for_selector(".jp-Notebook .jp-Cell", timeout=90_000)
        page.get_by_text("Python 3 (ipykernel) | Idle").wait_for(timeout=90_000)  # before, cells do not run
        page.click(".jp-Notebook .jp-Cell .cm-content")
        page.keyboard.press("Shift+Enter")
        page.wait_for_selector(".wb-explore img", timeout=90_000)
        picture = page.locator(".wb-explore img")
        before = picture.get_attribute("src")
        handle = page.locator(".wb-explore .noUi-handle").first
        value = page.locator(".wb-explore .widget-readout").first.inner_text()
        handle.focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        page.wait_for_function(
            "old => document.querySelector('.wb-explore img').src !== old", arg=before, timeout=30_000
        )
        page.wait_for_function(
            "old => document.querySelector('.wb-explore .widget-readout').innerText !== old", arg=value, timeout=30_000
        )
        page.get_by_role("button", name="pin this design").click()
        page.wait_for_function("() => document.querySelector('.wb-compare table').innerText.includes('design 1')")
        table = page.locator(".wb-compare table").inner_text()
        page.get_by_text("Margins, one point broken at a time").wait_for(timeout=60_000)  # once the sliders rest
        shown = os.environ.get("WORKBENCH_SCREENSHOT")  # a folder, to look at what a person would see
        page.screenshot(path=str(Path(shown or tmp_path) / "explorer.png"))
        browser.close()
    assert "design 1" in table
    assert re.search(r"cost J\s+\d", table)
    kept = json.loads((folder / "exploration.json").read_text())
    approved = json.loads((Path(__file__).parents[2] / "problems/heave/approved.json").read_text())["gains"]
    assert kept["gains"]["K_h"] > float(approved["K_h"])  # the arrow to the right raises the first slider's gain
    assert [pin["name"] for pin in kept["pins"]] == ["design 1"]
