"""The documentation of study files and their JSON schema are made from the sections."""

import json
import tomllib
from pathlib import Path

import pytest

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.study.documentation import json_schema, reference
from tipdamp.study.schema import SECTIONS

ROOT = Path(__file__).parents[3]


def test_documentation_is_up_to_date():
    assert (ROOT / "docs" / "study_files.md").read_text() == reference()


def test_json_schema_names_every_key(capsys):
    assert main(["keys", "--json-schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema == json_schema()
    for name, section in SECTIONS.items():
        assert set(schema["properties"][name]["properties"]) == set(section.model_fields)
    pull = schema["properties"]["damper"]["properties"]["pull"]
    assert pull["exclusiveMinimum"] == 0 and pull["description"].startswith("Fc, the total pull")
    assert schema["properties"]["contact"]["additionalProperties"]["properties"]["shape"][
        "enum"
    ] == ["cylinder", "flat", "rounded"]


@pytest.mark.parametrize(
    "old, new, valid",
    [
        ("pull = 10", "pull = 10", True),
        ("pull = 10", "pul = 10", False),
        ("pull = 10", "pull = -10", False),
        ("levels = [1]", "levels = 1", False),
        ("damping_ratio = 0.02", "damping_ratio = [0.02, 0.03]", True),
        ('shape = "flat"', 'shape = "flt"', False),
        ("[respond]", "[respond]\nlaw = 'IsotropicFriction'", True),
        ("[respond]", "[respond]\nlaw = 'Coulomb'", False),
        ("[respond]", "[respond]\nlaw = 'CubicSpring'", False),
        ("[respond]", "[respond]\nlaw = { name = 'CubicSpring', cubic = 1e12 }", True),
        ("[respond]", "[respond]\nlaw = { name = 'CubicSpring', cubc = 1e12 }", False),
        ("[respond]", "[respond]\nlaw = { name = 'DryFriction2T', cubic = 1e12 }", False),
        ("[respond]", "[tune]\nstations = 'all'\n[respond]", True),
        ("[respond]", "[loads.gas]\npressure = [['blades', 'touch_one', 1]]\n[respond]", True),
    ],
)
def test_editors_check_a_study(old, new, valid):
    jsonschema = pytest.importorskip("jsonschema")
    study = tomllib.loads(corner_study.TEXT.replace(old, new, 1))
    assert jsonschema.Draft202012Validator(json_schema()).is_valid(study) == valid


def test_defaults_of_the_schema_are_valid():
    jsonschema = pytest.importorskip("jsonschema")

    def defaults(schema):
        if "default" in schema:
            yield schema
        for inner in (*schema.get("properties", {}).values(), schema.get("additionalProperties")):
            if isinstance(inner, dict):
                yield from defaults(inner)

    found = list(defaults(json.loads(json.dumps(json_schema()))))
    assert len(found) > 20
    assert [s for s in found if not jsonschema.Draft202012Validator(s).is_valid(s["default"])] == []
