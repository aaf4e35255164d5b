"""MkDocs settings beyond mkdocs.yml: pages from elsewhere in the checkout, and links that lead to them.

Scenarios' own pages, notebooks, the changelog and the command line's reference are pages of the site without being
files of docs/, so that no text is there twice. Links are written as they hold in the checkout, and are led to them.
"""

import functools
import hashlib
import json
import os
import posixpath
import re
import shutil
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import typer.main
from code_digests import Checkout
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from typer.cli import get_docs_for_click

from fogsim.cli.app import app

ROOT = Path(__file__).resolve().parents[1]
COPIES = ROOT / "build" / "site"
LINK = re.compile(r"(!?\[[^\[\]]*\])\(([^)\s#]*)(#[^)\s]*)?\)")


def pages_elsewhere() -> Iterator[tuple[str, Path]]:
    """Place on the site, and file in the checkout, of each page that is no file of docs/."""
    yield "changelog.md", ROOT / "CHANGELOG.md"
    yield "contributing.md", ROOT / "CONTRIBUTING.md"
    yield "security.md", ROOT / "SECURITY.md"
    yield "notices.md", ROOT / "THIRD_PARTY_NOTICES.md"
    for page in sorted((ROOT / "scenarios").glob("*/README.md")):
        yield f"gallery/{page.parent.name}.md", page
    for notebook in sorted((ROOT / "notebooks").glob("*.ipynb")):
        yield f"notebooks/{notebook.name}", notebook


PLACES = {page.relative_to(ROOT).as_posix(): place for place, page in pages_elsewhere()}
"""Where each of them is on the site, by its path in the checkout."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the version below each page; notebooks that match `NOTEBOOKS_NOT_RUN` are shown without outputs."""
    config.plugins["mkdocs-jupyter"].config["execute_ignore"] = os.environ.get("NOTEBOOKS_NOT_RUN", "").split()
    config.copyright = f"FogSim {version('fogsim')}"
    return config


@event_priority(100)  # before the notebooks' plugin, which looks for what it reads
def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are no files of docs/."""
    # What notebooks have written when they ran the last time.
    shutil.rmtree(COPIES, ignore_errors=True)
    # Notebooks run without the settings of whoever builds the site; their kernels would warn of how they are reached.
    profile = COPIES / "ipython" / "profile_default"
    profile.mkdir(parents=True)
    (profile / "ipython_kernel_config.py").write_text("c.IPKernelApp.log_level = 'ERROR'\n", encoding="utf-8")
    os.environ["IPYTHONDIR"] = str(profile.parent)
    for place, page in pages_elsewhere():
        if page.suffix == ".ipynb":
            files.append(linked_notebook(place, page, config))
        else:
            # What once changed is not what somebody looks for.
            hidden = "---\nsearch:\n  exclude: true\n---\n" if place == "changelog.md" else ""
            files.append(File.generated(config, place, content=hidden + page.read_text(encoding="utf-8")))
    return files


def linked_notebook(place: str, notebook: Path, config: MkDocsConfig) -> File:
    """Give a notebook whose links hold on the site, as a file that the notebooks' plugin reads and runs."""
    copy = COPIES / place
    copy.parent.mkdir(parents=True, exist_ok=True)
    text = notebook.read_text(encoding="utf-8")
    led = led_to_pages(text, notebook.relative_to(ROOT).parent.as_posix(), place)
    content = json.loads(re.sub(r"\.md(#[^)\s]*)?\)", r".html\1)", led))
    # The plugin keeps outputs for as long as a notebook stays the same: they are of this code alone.
    content["metadata"]["code"] = code_digest()
    copy.write_text(json.dumps(content, ensure_ascii=False, indent=1), encoding="utf-8")
    return File(place, str(COPIES), config.site_dir, config.use_directory_urls)


@functools.cache
def code_digest() -> str:
    """Digest of the code and data on which outputs of notebooks depend."""
    modules = [
        one.relative_to(ROOT).as_posix() for folder in ("fogsim", "envs") for one in (ROOT / folder).rglob("*.py")
    ]
    files = Checkout(ROOT).files((*modules, "fogsim", "scenarios"))
    return hashlib.sha256(json.dumps(files).encode()).hexdigest()


@event_priority(100)
def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:  # noqa: ARG001 - MkDocs'
    """Lead links that hold in the checkout to pages of the site; what the site has not stays as text."""
    place = page.file.src_uri
    source = next((path for path, led in PLACES.items() if led == place), f"docs/{place}")
    if place == "reference/cli.md":
        markdown += command_line_reference()
    if source.startswith("scenarios/"):
        markdown = with_picture(markdown, Path(source).parent.name)
    return led_to_pages(markdown, posixpath.dirname(source), place)


def with_picture(markdown: str, scenario: str) -> str:
    """Put the gallery's picture of a scenario below the title of its page, if there is one."""
    pictures = sorted((ROOT / "docs" / "pictures" / "gallery").glob(f"{scenario}.*"))
    if not pictures:
        return markdown
    title, _, rest = markdown.partition("\n")
    return f"{title}\n\n![What the ego's camera sees](../../docs/pictures/gallery/{pictures[0].name})\n{rest}"


def led_to_pages(text: str, folder: str, place: str) -> str:
    """Lead the links of a text from a folder of the checkout to pages of the site, where it has a place."""

    def led(found: re.Match[str]) -> str:
        words, target, anchor = found[1], found[2], found[3] or ""
        if not target or "://" in target:
            return found[0]
        path = posixpath.normpath(posixpath.join(folder, target))
        page = PLACES.get(path) or (path.removeprefix("docs/") if path.startswith("docs/") else None)
        # What the site does not have is a file of the source tree: its name is left.
        return f"{words}({posixpath.relpath(page, posixpath.dirname(place) or '.')}{anchor})" if page else words[1:-1]

    return LINK.sub(led, text)


def command_line_reference() -> str:
    """Every command with its arguments and options, as ``--help`` has them."""
    command = typer.main.get_command(app)
    context = command.make_context("fogsim", [], resilient_parsing=True)
    text = get_docs_for_click(obj=command, ctx=context, name="fogsim")
    return "\n" + text.partition("\n")[2]
