import os
import shutil
from contextlib import contextmanager

import pytest
from playwright.sync_api import sync_playwright

from pipelines.report.html.report import report
from pipelines.report.session import find
from tests.report.sessions import write_session

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)


@pytest.fixture(scope="session")
def session_folder(tmp_path_factory):
    return write_session(tmp_path_factory.mktemp("sessions") / "leg", rig="bench", subject="S01")


@pytest.fixture(scope="session")
def page_file(session_folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("pages") / "report.html"
    path.write_text(report(find([session_folder])), encoding="utf-8")
    return path


# Not for the whole session: while it is there, an event loop runs in this thread, and nobody else's
# would start.
@pytest.fixture(scope="module")
def chromium():
    if CHROMIUM is None:
        pytest.skip("there is no chromium here; `apt-get install chromium` brings it")
    # As root, as in a container, chromium refuses to run in its own sandbox.
    args = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=args)
        yield browser
        browser.close()


@pytest.fixture
def opened(chromium):
    """Open a page from its file, without a network; what it complains of fails the test."""

    @contextmanager
    def open_(path, width=1280, height=900, **options):
        context = chromium.new_context(
            viewport={"width": width, "height": height}, offline=True, **options
        )
        page, complaints = context.new_page(), []
        page.on("console", lambda message: complaints.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "dialog",
            lambda dialog: complaints.append(f"dialog: {dialog.message}") or dialog.dismiss(),
        )
        try:
            page.goto(path.as_uri())
            yield page
            assert complaints == []
        finally:
            context.close()

    return open_
