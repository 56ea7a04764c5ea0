"""What the package holds of the explorer's page is what its sources make."""

from __future__ import annotations

import gzip
import subprocess
from importlib import resources
from pathlib import Path

import pytest

FILES = ("favicon.svg", "index.html", "main.js", "style.css")
#: Largest script [bytes, gzipped].
MOST = 40_000


def committed(name):
    return (resources.files("saltus.explore") / "page" / name).read_bytes()


def test_the_bundle_is_small_and_fetches_nothing():
    assert len(gzip.compress(committed("main.js"), 9)) <= MOST
    for name in FILES:
        text = committed(name).decode().replace("http://www.w3.org/2000/svg", "")
        assert "http:" not in text
        assert "https:" not in text
        assert "style=" not in text  # the policy of the page forbids it
        assert "eval(" not in text
        assert "innerHTML" not in text  # texts enter as text


@pytest.mark.slow
def test_the_sources_make_the_same_bytes(web):
    built = web / "built"
    subprocess.run(["node", "build.mjs", str(built)], cwd=web, check=True, timeout=120)
    assert sorted(path.name for path in built.iterdir()) == sorted(FILES)
    for name in FILES:
        assert (built / name).read_bytes() == committed(name), f"{name}: npm run build in web/"


@pytest.mark.slow
def test_the_sources_are_strictly_typed(web):
    run = subprocess.run(
        ["node", "node_modules/typescript/bin/tsc", "-p", "."],
        cwd=web,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout


def test_no_source_is_a_long_file():
    sources = Path(__file__).parents[2] / "web" / "src"
    if not sources.is_dir():
        pytest.skip("no sources of the page here")
    assert max(len(path.read_text().splitlines()) for path in sources.glob("*.ts")) <= 400
