"""The report, opened in a browser, shows its pictures and makes no request to a network."""

from __future__ import annotations

import pytest

from pdhocbf_drake.cli import main

playwright = pytest.importorskip("playwright.sync_api")


def test_the_report_opens_from_disk_and_requests_nothing(tmp_path, chromium):
    place = tmp_path / "out"
    assert main(["reproduce", "--only", "theorem,fig2", "--out", str(place)]) == 0
    urls: list[str] = []
    with playwright.sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=chromium)
        page = browser.new_page()
        page.on("request", lambda request: urls.append(request.url))
        page.goto((place / "report.html").as_uri())
        widths = page.evaluate("[...document.images].map(image => image.naturalWidth)")
        browser.close()
    assert len(widths) == 3
    assert min(widths) > 300
    assert all(url.startswith(("file:", "data:", "blob:")) for url in urls)
