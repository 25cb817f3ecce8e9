"""The parametric drive: an object with the design's fields, four parts that follow it, and a spreadsheet of results.

The drive asks the service, the parts and the sheet depend on it: a failed call leaves them all as they were, because FreeCAD
recomputes nothing whose source has an error.
"""

import FreeCAD

import toothwave_client
import toothwave_design
import toothwave_parts

DEFAULT_URL = "http://127.0.0.1:8080"
# A distance may be negative, where a length becomes 0 without a word: what is out of its range the service objects to.
QUANTITIES = {"mm": "App::PropertyDistance", "deg": "App::PropertyAngle"}
KINDS = {
    int: "App::PropertyInteger",
    float: "App::PropertyFloat",
    bool: "App::PropertyBool",
    str: "App::PropertyString",
}
SHOWN, HIDDEN = 0, 2  # FreeCAD's editor modes
PARTS = {"ring": "Ring", "carrier": "Carrier", "teeth": "Teeth", "wave_generator": "WaveGenerator"}
HEADINGS = ("Problem", "Peaks", "Period", "Findings", "No findings", "severity")
WIDTHS = {"A": 210, "B": 140, "C": 110, "D": 110, "F": 700, "G": 420, "H": 420}  # of the spreadsheet's columns, in pixels
OBJECTIONS = (toothwave_client.Problem, toothwave_client.NoService, toothwave_design.NoDocument)


class NoWindow:
    """What there is of a window where FreeCAD runs without; toothwave_panel puts its own in place."""

    def wait(self, call):
        """Makes a call to a service and gives its result."""
        return call()

    def show(self, problem):
        """Tells a problem that has just come up."""

    def dress(self, drive, parts):
        """Gives a new drive and its parts icon and colours."""


window = NoWindow()
_services = {}


def service_at(url):
    """One service for each address, so that all drives of a session share its answers."""
    return _services.setdefault(url, toothwave_client.Service(url, wait=lambda call: window.wait(call)))


class Stateless:
    """A proxy that has nothing to save: whatever it keeps can be asked for again. Two spellings, older and newer FreeCAD's."""

    def dumps(self):
        return None

    def loads(self, _state):
        return None

    __getstate__, __setstate__ = dumps, loads


class HarmonicDrive(Stateless):
    """Holds the design; asks for the drawing and the loads when it has changed."""

    drawing = None
    sweep = None
    problem = None

    def __init__(self, obj):
        obj.Proxy = self
        obj.addProperty(
            "App::PropertyString", "ServiceUrl", "Service", "Address of the toothwave service"
        ).ServiceUrl = DEFAULT_URL
        obj.addProperty("App::PropertyString", "Problem", "Service", "What the service objects to", 1)  # 1: read only
        self._complete(obj)
        set_document(obj, toothwave_design.START)

    def _complete(self, obj):
        """Adds the fields that the object lacks: all of a new one, of an older file's those that came later."""
        for field in toothwave_design.FIELDS:
            if not hasattr(obj, field.name):
                kind = "App::PropertyEnumeration" if field.choices else QUANTITIES.get(field.unit, KINDS[type(field.absent)])
                obj.addProperty(kind, field.name, field.group, f"{field.label}\n{field.tooltip}")
                setattr(obj, field.name, list(field.choices) or field.absent)
            elif field.choices and obj.getEnumerationsOfProperty(field.name) != list(field.choices):
                value = getattr(obj, field.name)
                setattr(obj, field.name, list(field.choices))
                setattr(obj, field.name, value)
        self._show_fields(obj)

    def _show_fields(self, obj):
        """Shows the fields of the chosen kinds in the property view, and hides those of the others."""
        choices = {name: getattr(obj, name) for name in toothwave_design.CHOOSING}
        for field in toothwave_design.FIELDS:
            if field.shown:
                obj.setEditorMode(field.name, SHOWN if field.is_shown(choices) else HIDDEN)

    def onDocumentRestored(self, obj):
        retired = {name: getattr(obj, name) for name in toothwave_design.RETIRED if hasattr(obj, name)}
        self._complete(obj)
        if retired:
            document = toothwave_design.with_retired(document_of(obj), retired)
            for name in retired:
                obj.removeProperty(name)
            set_document(obj, document)
            FreeCAD.Console.PrintWarning(f"{obj.Label}: gaps are clearances of the parts now, and refinements one choice\n")

    def onChanged(self, obj, name):
        # The last field is there when all are; a file's properties come one by one.
        if name in toothwave_design.CHOOSING and hasattr(obj, toothwave_design.OTHER):
            self._show_fields(obj)

    def execute(self, obj):
        """Asks the service. A drive that cannot be drawn is an error; one whose loads cannot be computed is drawn without."""
        service = service_at(obj.ServiceUrl)
        try:
            document = document_of(obj)
            self.drawing = service.drawing("assembly", document)
        except OBJECTIONS as problem:
            self._tell(obj, problem)
            raise RuntimeError(str(problem)) from None
        self.sweep = problem = None
        try:
            self.sweep = service.sweep(document)
        except OBJECTIONS as objection:
            problem = objection
            FreeCAD.Console.PrintError(f"{obj.Label}: {problem}\n")
        self._tell(obj, problem)

    def findings(self):
        """What a designer is told of the drive, under load and as it is drawn, each once."""
        findings = list(self.sweep["findings"]) if self.sweep else []
        return findings + [finding for finding in (self.drawing or {}).get("findings", ()) if finding not in findings]

    def _tell(self, obj, problem):
        """Keeps the problem and, where there is a window, shows it when the recomputation is over."""
        self.problem = problem
        text = str(problem or "")
        if text != obj.Problem:
            obj.Problem = text
            if text:
                window.show(text)

    def body(self, obj, part):
        """A part's body, asked for again where the document was just loaded."""
        if self.drawing is None:
            self.execute(obj)
        return next(body for body in self.drawing["bodies"] if body["part"] == part)


class DrivePart(Stateless):
    """The solids of one part, built anew only where its section has changed; else they just move."""

    section = None
    solid = None

    def __init__(self, obj, drive, part):
        obj.Proxy = self
        obj.addProperty("App::PropertyLink", "Drive", "Drive", "The drive that this is a part of").Drive = drive
        obj.addProperty("App::PropertyString", "DrivePart", "Drive", "Its name in the service's drawing", 1).DrivePart = part

    def execute(self, obj):
        body = obj.Drive.Proxy.body(obj.Drive, obj.DrivePart)
        section = {key: body[key] for key in ("outer", "holes", "width_mm", "solid")}
        if section != self.section:
            self.section, self.solid = section, toothwave_parts.solid_of(body)
        obj.Shape = shape = toothwave_parts.shape_of(body, self.solid)
        obj.Placement = shape.Placement  # during a recomputation FreeCAD takes it from there, not from the shape


class Results(Stateless):
    """The spreadsheet: peaks, what else the sweep says of the whole period, and its findings."""

    def __init__(self, obj, drive):
        obj.Proxy = self
        obj.addProperty("App::PropertyLink", "Drive", "Drive", "The drive that these are the results of").Drive = drive
        for column, width in WIDTHS.items():
            obj.setColumnWidth(column, width)
        obj.addProperty("App::PropertyInteger", "Rows", "Drive", "How many rows are filled", 4)  # 4: hidden

    def onDocumentRestored(self, obj):
        obj.recompute()  # FreeCAD restores the cells' text but evaluates it only then

    def execute(self, obj):
        if obj.Drive.Proxy.drawing is None:
            return False  # just loaded: what the file has still holds
        rows = _rows(obj.Drive.Proxy.sweep, obj.Drive.Problem, obj.Drive.Proxy.findings())
        for number in range(1, max(obj.Rows, len(rows)) + 1):
            row = rows[number - 1] if number <= len(rows) else ()
            for column, letter in enumerate("ABCDEFGH"):
                value = row[column] if column < len(row) else ""
                obj.set(f"{letter}{number}", _cell(value))
            obj.setStyle(f"A{number}:H{number}", "bold" if row and row[0] in HEADINGS else "", "replace")
        obj.Rows = len(rows)
        return False  # goes on with the sheet's own recomputation


def _cell(value):
    """As a cell takes it: what is not marked as text might be read as a formula."""
    return repr(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else f"'{value}" if value != "" else ""


def _rows(sweep, problem, findings):
    rows = [("Problem",), *((line,) for line in problem.splitlines())] if sweep is None else _results(sweep)
    rows += [(), ("Findings" if findings else "No findings",)]
    columns = ("severity", "code", "value", "limit", "unit", "detail", "advice")
    if findings:
        rows += [(*columns, "pointers")]
    return rows + [(*(finding.get(name, "") for name in columns), ", ".join(finding["pointers"])) for finding in findings]


def _results(sweep):
    peaks = {contact: dict(_leaves(values)) for contact, values in sweep["peaks"].items()}
    quantities = list(dict.fromkeys(name for values in peaks.values() for name in values))
    rows = [("Peaks", *peaks)]
    rows += [(name, *(values.get(name, "") for values in peaks.values())) for name in quantities]
    rows += [(), ("Period", "")]
    return rows + list(_leaves({name: value for name, value in sweep.items() if name not in ("peaks", "states", "findings")}))


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
    """Gives a drive the values of a design document; where it has none, what is meant then, or what a field begins with."""
    for name, value in toothwave_design.values_of(document).items():
        setattr(obj, name, value)


def make_drive(design=None, url=None, document=None):
    """A drive with its parts and results in a FreeCAD document; recompute it then."""
    document = document or FreeCAD.ActiveDocument or FreeCAD.newDocument("HarmonicDrive")
    group = document.addObject("App::Part", "Assembly")
    drive = document.addObject("App::FeaturePython", "HarmonicDrive")
    HarmonicDrive(drive)
    drive.ServiceUrl = url or DEFAULT_URL
    if design is not None:
        set_document(drive, design)
    objects = [drive]
    for part, name in PARTS.items():
        solid = document.addObject("Part::FeaturePython", name)
        DrivePart(solid, drive, part)
        objects.append(solid)
    sheet = document.addObject("Spreadsheet::SheetPython", "Results")
    Results(sheet, drive)
    objects.append(sheet)
    group.Group = objects
    window.dress(drive, objects[1:-1])
    return drive
