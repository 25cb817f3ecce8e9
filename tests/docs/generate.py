"""Writes what follows from the code: the pages of docs/reference for design document, quantities and settings, and the kinds
of wave generator, teeth, contact law and friction for page and FreeCAD.

    tests/docs/generate.py BINARY            writes them
    tests/docs/generate.py BINARY --check    compares them with the code, and findings.md and problems.md with the codes that there are;
                                             sends every design document of README and docs to the service

BINARY is the program `toothwave`: its `openapi` and `serve --help` say what there is, and a service of its own lists the quantities.
"""

import difflib
import json
import os
import re
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "docs" / "reference"
WRITTEN = "<!-- Written by tests/docs/generate.py from the code. -->"
KINDS_WRITTEN = "Kinds of the design document with their fields. Written by tests/docs/generate.py from the API document."
UNITS = [
    ("_mm3_per_nm", "mm³/(N·m)"), ("_mm_per_n", "mm/N"), ("_n_per_mm", "N/mm"), ("_nm", "N·m"), ("_mpa", "MPa"), ("_gpa", "GPa"),
    ("_rpm", "1/min"), ("_arcsec", "arcsec"), ("_deg", "°"), ("_um", "µm"), ("_mm", "mm"), ("_n", "N"),
]  # fmt: skip
LAST_PART = r"^(.*/)(carrier|ring|teeth|wave_generator)(?=$|/|_runout)"
UNIONS = {"/drive/wave_generator": "WaveGenerator", "/drive/teeth": "Teeth", "/model/stiffness": "Stiffness", "/friction/wave_generator": "WaveGeneratorFriction"}
SECTIONS = {
    "drive": "`drive` is required: every endpoint reads it.",
    "load": "",
    "materials": "",
    "model": "`compatibility` is `virtual_work` if left out. The answer's `model` is the complete model that was used.",
    "parts": "",
    "modification": "",
    "deviations": "",
    "friction": "",
    "sweep": "",
    "profile": "",
    "assembly": "",
    "accuracy": "",
}


class Document:
    """The API document."""

    def __init__(self, document):
        self.schemas = document["components"]["schemas"]

    def resolved(self, schema):
        """A schema with what it refers to; what stands beside the reference counts first."""
        if "$ref" in schema:
            target = self.schemas[schema["$ref"].rsplit("/", 1)[1]]
            return self.resolved({**target, **{name: value for name, value in schema.items() if name != "$ref"}})
        return schema

    def rows(self, schema, path, is_required=False):
        """One row for each field below: (path, schema, is_required)."""
        schema = self.resolved(schema)
        if word := self.word_of_choice(schema):
            yield from self.union(path, word, schema)
            return
        if "properties" not in schema:
            yield path, schema, is_required
        below = [(schema, path), (schema.get("items", {}), f"{path}/0")]
        below += [(variant, path) for variant in schema.get("oneOf", [])]
        for inner, at in below:
            inner = self.resolved(inner)
            for name, field in sorted(inner.get("properties", {}).items(), key=lambda item: "properties" in self.resolved(item[1])):
                field = {**field, "parent": schema.get("description", "")}
                yield from self.rows(field, f"{at}/{name}", name in inner.get("required", []))

    def word_of_choice(self, schema):
        """The field that tells the variants of a choice apart."""
        first, *others = [self.resolved(variant).get("properties", {}) for variant in schema.get("oneOf", [])] or [{}]
        return next((name for name, field in first.items() if len(field.get("enum", [])) == 1 and all(name in other for other in others)), None)

    def union(self, path, word, schema):
        """The fields of all variants. The variant that may leave out the word, or has none, is the default."""
        variants = [self.resolved(variant) for variant in schema["oneOf"]]
        named = {variant["properties"][word]["enum"][0]: variant for variant in variants if word in variant["properties"]}
        bare = [set(variant["properties"]) for variant in variants if word not in variant["properties"]]
        default = [
            name
            for name, variant in named.items()
            if "default" in variant["properties"][word] or set(variant["properties"]) - {word} in bare
        ]
        texts = " ".join(f"`{name}`: {first_sentence(variant['description'])}." for name, variant in named.items())
        row = {"description": f"{schema['description']} {texts}", "enum": list(named)}
        yield f"{path}/{word}", {**row, "default": default[0]} if default else row, not default and "left out" not in schema["description"]
        fields = {}
        for name, variant in named.items():
            for field, below in variant["properties"].items():
                if field != word:
                    same = field, below.get("minimum")
                    fields.setdefault(same, []).append((name, variant, {"parent": variant["description"], **below}))
        for (field, _), places in fields.items():
            needed = [name for name, variant, _ in places if field in variant.get("required", [])]
            names = ", ".join(f"`{name}`" for name in needed)
            needed = f"required by {names}" if 0 < len(needed) < len(places) else bool(needed)
            only = "" if len(places) == len(named) else f"({', '.join(f'`{name}`' for name, _, _ in places)}) "
            for at, row, is_required in self.rows(places[0][2], f"{path}/{field}", needed):
                yield at, {**row, **{key: only + row.get(key, "") for key in ("description", "parent")}}, is_required


def first_sentence(text):
    text = re.split(r"(?<=\.)\s|; ", " ".join(text.split()))[0].rstrip(".")
    return text[:1].lower() + text[1:]


def number(value):
    value = float(value)
    text = f"{value:g}"
    return re.sub(r"e([+-])0*(\d)", lambda found: "e" + found[1].replace("+", "") + found[2], text)


def allowed(document, schema):
    """What a field may be."""
    schema = document.resolved(schema)
    if "enum" in schema:
        return ", ".join(f"`{word}`" for word in schema["enum"])
    if schema.get("type") == "boolean":
        return "`true`, `false`"
    if schema.get("type") == "array":
        count = f"{schema['minItems']} to {schema['maxItems']} of: " if "maxItems" in schema else "list of: "
        return count + allowed(document, schema["items"])
    if "oneOf" in schema:
        return "; or ".join(allowed(document, variant) for variant in schema["oneOf"])
    if "exclusiveMinimum" in schema:
        return f"between {number(schema['exclusiveMinimum'])} and {number(schema['exclusiveMaximum'])}"
    if "minimum" in schema:
        return f"{number(schema['minimum'])} to {number(schema['maximum'])}"
    return "object"


def unit(path):
    names = path.split("/")[::-1]
    return next((unit for name in names for end, unit in UNITS if name.endswith(end)), "")


def default(schema, is_required):
    if is_required:
        return "required" if is_required is True else is_required
    value = schema.get("default")
    if value is None or isinstance(value, dict):
        return ""
    return number(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else f"`{json.dumps(value)}`".replace('"', "")


def table(rows):
    head, *rest = rows
    lines = [head, ["---"] * len(head), *rest]
    return "\n".join("| " + " | ".join(str(cell).replace("|", r"\|") for cell in line) + " |" for line in lines)


def merged(rows):
    """Rows that differ by the part alone as one, with what their parent says."""
    groups = {}
    for path, schema, is_required, kind in rows:
        same = re.sub(LAST_PART, r"\1*", path)
        groups.setdefault((same, kind), []).append((path, schema, is_required))
    for (same, kind), members in groups.items():
        meanings = {" ".join(schema.get("description", "").split()) for _, schema, _ in members}
        names_part_alone = all(re.match(r"(\(.*\) )?(At|Of|Between) ", meaning) for meaning in meanings)
        if len(members) == 1 or len(meanings) > 1 and not names_part_alone:
            for path, schema, _ in members:
                yield path, kind, " ".join(schema.get("description", "").split())
            continue
        parts = [re.search(LAST_PART, path)[2] for path, _, _ in members]
        meaning = meanings.pop() if len(meanings) == 1 else " ".join(members[0][1].get("parent", "").split())
        yield same.replace("*", "{" + ",".join(parts) + "}"), kind, meaning


def design_document(document):
    design = document.schemas["Design"]
    parts = [
        "# Design document",
        WRITTEN,
        "One JSON document describes a drive and what is asked of it. Each endpoint reads only what it needs.\n"
        "A field that is not listed here gets 422 `unknown_field`. If the column of defaults is empty, the meaning says what is taken instead. "
        "If it does not, the field is not used. An entry of a list is written as `/0`. Fields that differ by the part alone share a line.",
    ]
    for name, note in SECTIONS.items():
        rows = [["field", "unit", "allowed", "default", "meaning"]]
        old, fields = [], []
        for path, schema, is_required in document.rows(design["properties"][name], f"/{name}"):
            if schema.get("deprecated"):
                old.append(f"`{path}`")
            else:
                fields.append((path, schema, is_required, (unit(path), allowed(document, schema), default(schema, is_required))))
        rows += [[f"`{path}`", *kind, meaning] for path, kind, meaning in merged(fields)]
        text = f"{note} {' '.join(document.resolved(design['properties'][name])['description'].split())}".strip()
        parts += [f"## {name}", text, table(rows)]
        if old:
            parts.append(f"Deprecated: {', '.join(old)}; see [migration](../how-to/migration.md#design-documents).")
    unlisted = set(design["properties"]) - set(SECTIONS)
    assert not unlisted, f"SECTIONS of generate.py lacks {unlisted}"
    return "\n\n".join(parts) + "\n"


def kinds(document):
    """The fields of each kind, by the place of the union and the kind's name; what all kinds have is left out."""
    found = {}
    for place, name in UNIONS.items():
        schema = document.schemas[name]
        word = document.word_of_choice(schema)
        variants = [document.resolved(variant) for variant in schema["oneOf"]]
        common = set.intersection(*(set(variant["properties"]) for variant in variants))
        found[place] = {}
        for variant in variants:
            rows = document.rows({**variant, "properties": {name: field for name, field in variant["properties"].items() if name not in common}}, place)
            (kind,) = variant["properties"][word]["enum"]
            # Numbers and choices alone have a field in a form.
            found[place][kind] = [kind_field(path, field, is_required) for path, field, is_required in rows if "/0" not in path and field.keys() & {"enum", "minimum"}]
    return found


def kinds_text(found):
    """The kinds as JSON, one line for each field."""
    text = json.dumps(found, ensure_ascii=False, indent=1)
    return re.sub(r"\{\n {4}([^{}]*?)\n {3}\}", lambda field: "{ " + re.sub(r"\n {4,}", " ", field[1]) + " }", text)


def kind_field(path, schema, is_required):
    field = {"pointer": path, "unit": unit(path).replace("°", "deg"), "meaning": " ".join(schema["description"].split())}
    if "enum" in schema:
        return {**field, "choices": schema["enum"]}
    return {**field, "low": schema["minimum"], "high": schema["maximum"], "is_whole": schema["type"] == "integer", "is_required": is_required}


def quantities(listed):
    needs = {"drive": "", "load": "a load", "allowable_stress": "an allowable stress", "carrier_strength": "the carrier's strength", "friction": "a load and friction"}
    rows = [["quantity", "unit", "needs", "meaning"]]
    for quantity in listed:
        words = needs.get(quantity["needs"], quantity["needs"].replace("_", " "))
        meaning = quantity["meaning"] + (" A flag: 1 or 0." if quantity["is_flag"] else "")
        definition = quantity["source"].get("definition", "")
        if definition and not definition.startswith(("the largest of", "the least of")):
            meaning += f" ({definition[:1].upper() + definition[1:]}.)"
        rows.append([f"`{quantity['name']}`", quantity["unit"], words, meaning])
    return "\n\n".join([
        "# Quantities",
        WRITTEN,
        "A study asks for these by name. `GET /v1/quantities` lists them with the answer and the field that hold each.",
        table(rows),
    ]) + "\n"  # fmt: skip


def settings(help_text):
    rows = [["flag", "variable", "default", "meaning"]]
    for line in help_text.splitlines():
        found = re.match(r"\s+--([\w-]+) <([^>]+)>\s+(.*)", line)
        if not found:
            continue
        flag, value, text = found.groups()
        variable = re.search(r" \[env: (\w+)=[^\]]*\]", text)
        given = re.search(r" \[default: ([^\]]*)\]", text)
        meaning = re.sub(r" \[(env|default): [^\]]*\]", "", text)
        rows.append([f"`--{flag} {value}`", f"`{variable[1]}`", given[1] if given else "none", meaning + "."])
    return "\n\n".join([
        "# Settings",
        WRITTEN,
        "Each setting of `toothwave serve` is a flag and a variable. A flag counts before a variable. *Memory limit* means the limit of the\n"
        "control group, or the memory of the machine if that is less. The image sets `TOOTHWAVE_LISTEN` to `0.0.0.0:8080`.",
        table(rows),
    ]) + "\n"  # fmt: skip


def of(binary, *words):
    clean = {name: value for name, value in os.environ.items() if not name.startswith("TOOTHWAVE_")}
    return subprocess.run([binary, *words], env=clean, check=True, capture_output=True, text=True).stdout


@contextmanager
def service(binary):
    """The address of a service, while it is used."""
    process = subprocess.Popen([binary, "--listen", "127.0.0.1:0"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield next(found[0] for line in process.stdout if (found := re.search(r"http://[0-9.:]+", line)))
    finally:
        process.terminate()
        process.wait()


def listed_quantities(address):
    with urllib.request.urlopen(f"{address}/v1/quantities", timeout=10) as answer:
        return json.load(answer)["quantities"]


def refused_documents(address):
    """Design documents of the texts that have no sweep."""
    for file in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for text in re.findall(r"^(?:```json|cat > .* <<'END')\n(\{\s*\"drive\".*?)^(?:```|END)$", file.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
            request = urllib.request.Request(f"{address}/v1/sweep", text.encode(), {"Content-Type": "application/json"})
            try:
                urllib.request.urlopen(request, timeout=60).close()
            except urllib.error.HTTPError as error:
                yield f"{file.relative_to(ROOT)}: {error.read().decode()}\n{text}"


def differing_codes(document):
    """Headings and rows of findings.md and problems.md against the codes that there are."""
    findings, problems = ((REFERENCE / name).read_text(encoding="utf-8") for name in ("findings.md", "problems.md"))
    for what, found, schema in [
        ("findings.md, headings", re.findall(r"^## `(\w+)`", findings, re.MULTILINE), "FindingCode"),
        ("problems.md, problems", re.findall(r"^\| `(\w+)` \| \d", problems, re.MULTILINE), "ProblemCode"),
        ("problems.md, fields", re.findall(r"^\| `(\w+)` \| \D", problems, re.MULTILINE), "FieldCode"),
    ]:
        codes = set(document.schemas[schema]["enum"])
        if differing := codes ^ set(found):
            yield f"{what}: missing or too many: {', '.join(sorted(differing))}"


def main(binary, is_check):
    document = Document(json.loads(of(binary, "openapi")))
    faults = list(differing_codes(document))
    with service(binary) as address:
        written = {
            "docs/reference/design-document.md": design_document(document),
            "docs/reference/quantities.md": quantities(listed_quantities(address)),
            "docs/reference/settings.md": settings(of(binary, "serve", "--help")),
            "src/service/page/kinds.js": f"// {KINDS_WRITTEN}\nexport const KINDS = {kinds_text(kinds(document))};\n",
            "clients/freecad/toothwave_kinds.json": kinds_text(kinds(document)) + "\n",
        }
        faults += refused_documents(address)
    for name, text in written.items():
        file = ROOT / name
        there = file.read_text(encoding="utf-8") if file.exists() else ""
        if not is_check:
            file.write_text(text, encoding="utf-8")
        elif there != text:
            faults += difflib.unified_diff(there.splitlines(), text.splitlines(), name, "the code", lineterm="", n=0)
    if faults:
        sys.exit("\n".join([*faults, "write the files anew: tests/docs/generate.py BINARY"]))


if __name__ == "__main__":
    main(sys.argv[1], "--check" in sys.argv[2:])
