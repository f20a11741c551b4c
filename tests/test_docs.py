"""The documentation matches the code: generated parts are up to date, links have targets, examples run."""

import ast
import re
from pathlib import Path

import pytest

from docs.generate import FILES, MARKED, PAGES, PARTS, renewed
from swarm.planning.grid import Grid
from swarm.planning.path import Path as PlannedPath
from swarm.planning.path import line_is_free, plan
from swarm.scenario.check import check
from swarm.scenario.load import load
from tests.shared import mostly_long

ROOT = Path(__file__).parents[1]
LINK = re.compile(r"\[[^\]]*\]\(([^)#\s]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("page", PAGES)
def test_generated_parts_are_what_the_code_says(page: str) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    assert renewed(text) == text, "out of date: python -m docs.generate"


@pytest.mark.parametrize(
    "picture", mostly_long("draws runs of a whole fleet", FILES, *FILES.keys() - {"pictures/handover.svg"})
)
def test_generated_pictures_are_what_the_code_draws(picture: str) -> None:
    drawn = (ROOT / "docs" / picture).read_text(encoding="utf-8")
    assert drawn == FILES[picture](), "out of date: python -m docs.generate"


def test_every_generated_part_is_on_a_page() -> None:
    marked = {
        match[2] for page in PAGES for match in MARKED.finditer((ROOT / "docs" / page).read_text(encoding="utf-8"))
    }
    assert marked == set(PARTS)


def test_links_between_pages_lead_somewhere() -> None:
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]:
        links = [link for link in LINK.findall(page.read_text(encoding="utf-8")) if "://" not in link]
        assert [link for link in links if not (page.parent / link).exists()] == [], page.name


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    headings = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", line) for line in re.findall(r"^#+ (.*)$", text, re.MULTILINE)]
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_links_to_a_heading_lead_to_one() -> None:
    lost = [
        (page.name, link)
        for page in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
        for link in re.findall(r"\]\(([^)\s:]*#[^)\s]+)\)", page.read_text(encoding="utf-8"))
        if (target := page.parent / link.split("#")[0] if link[0] != "#" else page).suffix == ".md"
        and link.split("#")[1] not in anchors(target)
    ]
    assert lost == []


SPAN = re.compile(r"`([^`\n]+)`")
HOME = re.compile(r"[\w.-]+/[\w./-]+\.(?:py|yaml|md|json)")  # a file with its folder
CALL = re.compile(r"\.(\w+)\(")
OURS = ("swarm", "world", "dashboard", "benchmarks", "docs")
SOURCES = "\n".join(file.read_text(encoding="utf-8") for room in OURS for file in (ROOT / room).rglob("*.py"))


def test_files_and_functions_that_a_page_names_are_there() -> None:
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        spans = SPAN.findall(text)
        files = [span for span in spans if HOME.fullmatch(span)]
        lost = [file for file in files if not (ROOT / file).exists() and not (ROOT / "swarm" / file).exists()]
        assert lost == [], page.name
        calls = {name for span in spans for name in CALL.findall(span)}
        assert [name for name in sorted(calls) if f"def {name}(" not in SOURCES] == [], page.name


PAIR = re.compile(r"`([\w./-]+\.py)` `([A-Za-z_][\w.]*)`")  # a file, and a function or class of it


def defined(file: Path) -> set[str]:
    """Return the functions and classes of a file, a class's own with its name before them."""
    found = set()
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        if isinstance(node, ast.ClassDef):
            found |= {f"{node.name}.{one.name}" for one in node.body if isinstance(one, ast.FunctionDef)}
    return found


def test_a_function_that_a_page_names_with_its_file_is_defined_there() -> None:
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        pairs = PAIR.findall(page.read_text(encoding="utf-8"))
        assert [(file, name) for file, name in pairs if name not in defined(ROOT / file)] == [], page.name


def test_the_pages_say_where_a_question_is_answered() -> None:
    table = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8").split("## Where a question is answered")[1]
    assert len(PAIR.findall(table)) > 20, "the pattern still finds what the table has"


def blocks(page: str, language: str) -> list[str]:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def test_the_scenario_on_its_page_is_one(tmp_path: Path) -> None:
    (block,) = blocks("scenarios.md", "yaml")
    (tmp_path / "small.yaml").write_text(block, encoding="utf-8")
    scenario = load(tmp_path / "small.yaml")
    assert check(scenario, scenario.settings.count, scenario.settings.seed).scenario.settings.name == "small"


def test_the_python_of_the_pages_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (planning,), (fuzzy,) = blocks("planning.md", "python"), blocks("fuzzy.md", "python")
    floor = load(ROOT / "scenarios" / "office.yaml").map
    given = {"Grid": Grid, "plan": plan, "line_is_free": line_is_free, "map": floor, "x": 1.2, "y": 1.0, "s": 0.0}
    exec(planning, given)
    assert isinstance(given["path"], PlannedPath)
    assert given["s"] == pytest.approx(0.2, abs=0.1), "0.2 m along the path"
    exec(fuzzy)
    assert capsys.readouterr().out.startswith("profile paper")
