"""The parametric drive: an object with the design's fields, four parts that follow it, and a spreadsheet of results.

The drive asks the service, the parts and the sheet depend on it: a failed call leaves them all as they were, because FreeCAD
recomputes nothing whose source has an error.
"""

import json

import FreeCAD
import toothwave_client
import toothwave_design
import toothwave_parts

DEFAULT_URL = "http://127.0.0.1:8080"
QUANTITIES = {"mm": "App::PropertyLength", "deg": "App::PropertyAngle"}
KINDS = {int: "App::PropertyInteger", float: "App::PropertyFloat", bool: "App::PropertyBool"}
PARTS = {  # as the service names them: our object, its colour
    "ring": ("Ring", (0.36, 0.42, 0.50)),
    "carrier": ("Carrier", (0.78, 0.68, 0.48)),
    "teeth": ("Teeth", (0.88, 0.89, 0.91)),
    "wave_generator": ("WaveGenerator", (0.25, 0.50, 0.66)),
}

_services = {}


def service_at(url):
    """One service for each address, so that all drives of a session share its answers."""
    return _services.setdefault(url, toothwave_client.Service(url))


class _Stateless:
    """A proxy that has nothing to save: whatever it keeps can be asked for again. Two spellings, older and newer FreeCAD's."""

    def dumps(self):
        return None

    def loads(self, _state):
        return None

    __getstate__, __setstate__ = dumps, loads


class HarmonicDrive(_Stateless):
    """Holds the design; asks for the drawing and the loads when it has changed."""

    drawing = None
    sweep = None

    def __init__(self, obj):
        obj.Proxy = self
        obj.addProperty("App::PropertyString", "ServiceUrl", "Service", "Address of the toothwave service").ServiceUrl = DEFAULT_URL
        obj.addProperty("App::PropertyString", "Problem", "Service", "What the service objects to", 1)  # 1: read only
        for field in toothwave_design.FIELDS:
            kind = "App::PropertyEnumeration" if field.choices else QUANTITIES.get(field.unit, KINDS[type(field.default)])
            obj.addProperty(kind, field.name, field.group, f"{field.label}\n{field.tooltip}")
            if field.choices:
                setattr(obj, field.name, list(field.choices))
            setattr(obj, field.name, field.default)

    def execute(self, obj):
        """Asks the service. A drive that cannot be drawn is an error; one whose loads cannot be computed is drawn without."""
        service, document = service_at(obj.ServiceUrl), document_of(obj)
        try:
            self.drawing = service.drawing("assembly", document)
        except (toothwave_client.Problem, toothwave_client.NoService) as problem:
            _tell(obj, str(problem))
            raise RuntimeError(str(problem)) from None
        try:
            self.sweep = service.sweep(document)
            _tell(obj, "")
        except (toothwave_client.Problem, toothwave_client.NoService) as problem:
            self.sweep = None
            _tell(obj, str(problem))
            FreeCAD.Console.PrintError(f"{obj.Label}: {problem}\n")

    def body(self, obj, part):
        """A part's body, asked for again where the document was just loaded."""
        if self.drawing is None:
            self.execute(obj)
        return next(body for body in self.drawing["bodies"] if body["part"] == part)


class DrivePart(_Stateless):
    """The solids of one part, built anew only where its section has changed; else they just move."""

    section = None
    prism = None

    def __init__(self, obj, drive, part):
        obj.Proxy = self
        obj.addProperty("App::PropertyLink", "Drive", "Drive", "The drive that this is a part of").Drive = drive
        obj.addProperty("App::PropertyString", "DrivePart", "Drive", "Its name in the service's drawing", 1).DrivePart = part

    def execute(self, obj):
        body = obj.Drive.Proxy.body(obj.Drive, obj.DrivePart)
        section = {key: body[key] for key in ("outer", "holes", "width_mm")}
        if section != self.section:
            self.section, self.prism = section, toothwave_parts.prism_of(body)
        obj.Shape = toothwave_parts.shape_of(body, self.prism)


class Results(_Stateless):
    """The spreadsheet: peaks, what else the sweep says of the whole period, and its findings."""

    def __init__(self, obj, drive):
        obj.Proxy = self
        obj.addProperty("App::PropertyLink", "Drive", "Drive", "The drive that these are the results of").Drive = drive
        obj.addProperty("App::PropertyInteger", "Rows", "Drive", "How many rows are filled", 4)  # 4: hidden

    def execute(self, obj):
        rows = _rows(obj.Drive.Proxy.sweep, obj.Drive.Problem)
        for number in range(1, max(obj.Rows, len(rows)) + 1):
            row = rows[number - 1] if number <= len(rows) else ()
            for column, letter in enumerate("ABCDEFGH"):
                value = row[column] if column < len(row) else ""
                obj.set(f"{letter}{number}", _cell(value))
        obj.Rows = len(rows)
        return False  # goes on with the sheet's own recomputation


def _cell(value):
    """As a cell takes it: what is not marked as text might be read as a formula."""
    return repr(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else f"'{value}" if value != "" else ""


def _rows(sweep, problem):
    if sweep is None:
        return [("Problem",), *((line,) for line in problem.splitlines())]
    peaks = {contact: dict(_leaves(values)) for contact, values in sweep["peaks"].items()}
    quantities = list(dict.fromkeys(name for values in peaks.values() for name in values))
    rows = [("Peaks", *peaks)]
    rows += [(name, *(values.get(name, "") for values in peaks.values())) for name in quantities]
    rows += [(), ("Period", "")]
    rows += _leaves({name: value for name, value in sweep.items() if name not in ("peaks", "states", "findings")})
    columns = ("severity", "code", "value", "limit", "unit", "detail", "advice")
    rows += [(), ("Findings" if sweep["findings"] else "No findings",)]
    if sweep["findings"]:
        rows += [(*columns, "pointers")]
    rows += [(*(finding.get(name, "") for name in columns), ", ".join(finding["pointers"])) for finding in sweep["findings"]]
    return rows


def _leaves(values, prefix=""):
    """The values of nested objects, each under its path."""
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{name}.")
        elif not isinstance(value, list):
            yield prefix + name, value


def document_of(obj):
    """The design document of a drive's properties."""
    values = {field.name: getattr(obj, field.name) for field in toothwave_design.FIELDS}
    return toothwave_design.document_of({name: getattr(value, "Value", value) for name, value in values.items()})


def set_document(obj, document):
    """Gives a drive the values of a design document, defaults where it has none."""
    for name, value in toothwave_design.values_of(document).items():
        setattr(obj, name, value)


def make_drive(design=None, url=DEFAULT_URL, document=None):
    """A drive with its parts and results in a FreeCAD document; recompute it then."""
    document = document or FreeCAD.ActiveDocument or FreeCAD.newDocument("HarmonicDrive")
    group = document.addObject("App::Part", "Assembly")
    drive = document.addObject("App::FeaturePython", "HarmonicDrive")
    HarmonicDrive(drive)
    drive.ServiceUrl = url
    if design is not None:
        set_document(drive, design)
    objects = [drive]
    for part, (name, _) in PARTS.items():
        solid = document.addObject("Part::FeaturePython", name)
        DrivePart(solid, drive, part)
        objects.append(solid)
    sheet = document.addObject("Spreadsheet::SheetPython", "Results")
    Results(sheet, drive)
    objects.append(sheet)
    group.addObjects(objects)
    if FreeCAD.GuiUp:
        import toothwave_panel

        toothwave_panel.dress(drive, sheet, objects[1:-1])
    return drive


def _tell(obj, problem):
    """Keeps the problem as a property and, where there is a window, shows it when the recomputation is over."""
    is_new = problem and problem != obj.Problem
    if problem != obj.Problem:
        obj.Problem = problem
    if is_new and FreeCAD.GuiUp:
        import toothwave_panel

        toothwave_panel.show_later(problem)


def same(one, other):
    """Whether two design documents say the same."""
    return json.dumps(one, sort_keys=True) == json.dumps(other, sort_keys=True)
