"""Files for maintainers: the recipe, the citation and the form for issues."""

import re
import tomllib

import yaml
from blocks import ROOT
from cffconvert.cli.create_citation import create_citation

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

#: Name in the Python index -> name of the package in conda-forge, where they differ.
CONDA_NAMES = {"duckdb": "python-duckdb", "matplotlib": "matplotlib-base"}


def requirement(text: str) -> tuple[str, str]:
    """Return name and limits of a requirement of either kind."""
    name, limits = re.fullmatch(r"([\w.-]+)\s*(.*)", text).groups()
    return name.lower(), limits


def recipe() -> dict:
    """Return the recipe with the version in its place; comments behind values are dropped."""
    text = (ROOT / "docs" / "recipe" / "meta.yaml").read_text(encoding="utf-8")
    version = re.search(r'\{% set version = "(.*?)" %\}\n', text)
    text = text.replace(version[0], "").replace("{{ version }}", version[1])
    return yaml.safe_load(text.replace("{{ PYTHON }}", "python"))


def test_the_recipe_needs_what_the_package_needs():
    ours = dict(map(requirement, PROJECT["dependencies"]))
    expected = {CONDA_NAMES.get(name, name): limits for name, limits in ours.items()}
    expected["python"] = PROJECT["requires-python"]
    assert dict(map(requirement, recipe()["requirements"]["run"])) == expected


def test_the_recipe_has_the_version_licence_and_commands_of_the_package():
    made = recipe()
    assert made["package"] == {"name": PROJECT["name"], "version": PROJECT["version"]}
    assert made["about"]["license"] == PROJECT["license"]
    commands = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert made["build"]["entry_points"] == commands


def test_the_recipe_is_built_by_the_same_tool():
    backend = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["build-system"]
    host = dict(map(requirement, recipe()["requirements"]["host"]))
    assert {requirement(text) for text in backend["requires"]} <= set(host.items())


def test_the_citation_is_valid_and_of_this_version():
    # the schema comes with cffconvert: no network
    citation = create_citation(str(ROOT / "CITATION.cff"), None)
    citation.validate()
    content = yaml.safe_load(citation.cffstr)
    assert content["version"] == PROJECT["version"]
    assert content["license"] == PROJECT["license"]


def test_the_form_for_issues_asks_for_run_json():
    folder = ROOT / ".github" / "ISSUE_TEMPLATE"
    form = yaml.safe_load((folder / "wrong_result.yml").read_text(encoding="utf-8"))
    fields = {field["id"]: field for field in form["body"] if "id" in field}
    assert fields["run"]["attributes"]["label"] == "run.json"
    assert fields["run"]["validations"]["required"]
    assert {field["type"] for field in form["body"]} <= {"markdown", "textarea"}
