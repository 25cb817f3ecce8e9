"""The design document as a table of fields: what the object's properties and the dialog are made of. No FreeCAD here."""

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path

CONTACTS = (("wave_generator", "Wave generator"), ("ring", "Ring"), ("carrier", "Carrier"))
PARTS = (CONTACTS[0], ("teeth", "Teeth"), *CONTACTS[1:])
BY_DEFAULT = "default"  # a choice that the document leaves to the service
FLAGS = {"yes": True, "no": False}
SWITCHES = ("ring_teeth_bend", "wave_generator_moves", "corner_contact")  # deprecated, of the model
LOBES = {"ellipse": 2, "eccentric": 1}  # of other kinds they are a field
PROJECTED = ("linear", "palmgren", "fixed")  # the laws that `projection` takes

# The fields of each kind, by the place of what comes in kinds. A kind or field without an entry below has its name in the document.
KINDS = json.loads(Path(__file__).with_name("toothwave_kinds.json").read_text(encoding="utf-8"))
CHOOSING_KINDS = {
    "/drive/wave_generator": "WaveGeneratorKind",
    "/drive/teeth": "ToothShape",
    "/model/stiffness": "StiffnessLaw",
    "/friction/wave_generator": "FrictionKind",
}

# Of the service's API document.
LENGTH_MM = (1e-6, 1e6)
COUNT = (2, 10000)
TORQUE_NM = (1e-12, 1e15)
STIFFNESS_N_PER_MM = (1e-3, 1e15)
GAP_UM = (0.0, 1e6)
EITHER_WAY_UM = (-1e6, 1e6)
EITHER_WAY_ARCSEC = (-1e5, 1e5)
SHARE = (0.0, 1.0)


class NoDocument(ValueError):
    """What the fields and a design document cannot say to each other."""


@dataclass(frozen=True)
class Field:
    """One value of the document. Lengths in mm and angles in degrees become quantities; other units stand in the name."""

    pointer: str
    name: str
    label: str
    group: str
    default: object = None  # what holds where the document leaves the field out; a field that it must have has a `start`
    unit: str = ""
    limits: tuple = ()  # least and greatest
    start: object = None  # what it begins with, where the document must have it
    blank: str = ""  # what the default stands for, where it is no value of its own
    choices: tuple = ()
    shown: tuple = ()  # the name of a choice, and at which of its values the document has the field
    is_flag: bool = False  # whether the choices stand for true and false, besides what is left to the service
    is_object: bool = False  # whether there is an object at the pointer, whose values are fields of their own
    held: tuple = ()  # of the limits what a property of FreeCAD holds, where it is less

    @property
    def absent(self):
        """The value where a document has none."""
        return self.default if self.start is None else self.start

    @property
    def tooltip(self):
        """Where the value stands in the document, its range, and what it means to leave it out."""
        lines = [self.pointer] if self.pointer else []
        if self.limits:
            least, greatest = self.held or self.limits
            lines.append(f"{least:g} to {greatest:g} {self.unit}".strip())
        if self.blank:
            lines.append(f"{self.default or 'empty'}: {self.blank}" if isinstance(self.default, str) else f"0: {self.blank}")
        return "\n".join(lines)

    def takes(self, value):
        """Whether a document's value can stand in the field; what has several values, or is too much for FreeCAD, cannot."""
        if self.held and isinstance(value, (int, float)):
            return self.held[0] <= value <= self.held[1]
        # Of several choices a field shows none: the list stands among the other fields.
        return not isinstance(value, dict) and not (self.choices and isinstance(value, list))

    def is_shown(self, values):
        """Whether the document has such a field, as the choices stand."""
        return not self.shown or values[self.shown[0]] in self.shown[1]


def _named(label):
    return label.title().replace(" ", "")


def _drive():
    kind, group = "WaveGeneratorKind", "Wave generator"
    place = "/drive/wave_generator"

    def length(key, name, label, start):
        return Field(f"{place}/{key}", name, label, group, unit="mm", limits=LENGTH_MM, start=start)

    yield Field(f"{place}/kind", kind, "Kind", group, start="ellipse", choices=tuple(KINDS[place]))
    yield length("semi_major_mm", "SemiMajor", "Semi-major axis a", 58.0)
    yield length("semi_minor_mm", "SemiMinor", "Semi-minor axis b", 56.0)
    yield length("radius_mm", "CircleRadius", "Radius R₀", 57.0)
    yield length("eccentricity_mm", "Eccentricity", "Eccentricity e", 1.0)
    yield Field(f"{place}/lobes", "Lobes", "Lobes U", group, limits=(1, 1000), start=2)
    yield length("mean_radius_mm", "MeanRadius", "Mean radius R₀", 57.0)
    yield length("mean_path_radius_mm", "MeanPathRadius", "Mean radius of the path R", 62.0)
    yield length("amplitude_mm", "Amplitude", "Amplitude e", 1.0)

    shape, group, place = "ToothShape", "Teeth and ring", "/drive/teeth"
    yield Field(f"{place}/shape", shape, "Shape of the teeth", group, start="cylinder", choices=tuple(KINDS[place]))
    yield Field(f"{place}/count", "ToothCount", "Teeth in theory", group, limits=COUNT, start=28)
    yield Field(f"{place}/installed", "InstalledTeeth", "Teeth installed", group, 0, limits=COUNT, blank="all")
    yield Field(f"{place}/radius_mm", "ToothRadius", "Tooth radius r", group, unit="mm", limits=LENGTH_MM, start=5.0)
    yield Field(f"{place}/width_mm", "ToothWidth", "Tooth width", group, unit="mm", limits=LENGTH_MM, start=15.0)
    yield Field(f"{place}/flat_length_mm", "FlatLength", "Flats, length", group, None, "mm", LENGTH_MM, 4.0)
    for contact, label in CONTACTS:
        pointer, name = f"{place}/groove_radius_mm/{contact}", f"{_named(label)}GrooveRadius"
        yield Field(pointer, name, f"Groove, {label.lower()}", group, 0.0, "mm", LENGTH_MM, blank="no groove")
    yield Field("/drive/ring/teeth", "RingTeeth", "Ring teeth", group, limits=COUNT, start=26)
    yield Field("/drive/ring/tip_radius_mm", "TipRadius", "Ring's tip bored to", group, 0.0, "mm", LENGTH_MM, blank="natural tip")

    pointer, turns, turn = "/assembly/input_angle_deg", (-1e7, 1e7), (-360.0, 360.0)
    yield Field(pointer, "InputAngle", "Input angle", "Assembly", 0.0, "deg", turns, held=turn)


def _load():
    group = "Load"

    def load(key, name, label, unit, limits, blank):
        return Field(f"/load/{key}", name, label, group, 0.0, unit, limits, blank=blank)

    yield load("input_torque_nm", "InputTorqueNm", "Input torque", "N·m", TORQUE_NM, "left out")
    yield load("output_torque_nm", "OutputTorqueNm", "or output torque", "N·m", TORQUE_NM, "left out")
    yield load("input_speed_rpm", "InputSpeedRpm", "Input speed", "rpm", (1e-6, 1e6), "left out")
    yield load("allowable_stress_mpa", "AllowableStressMPa", "Allowable stress", "MPa", (1e-3, 1e6), "not asked")


def _model():
    group, free = "Model", "left to the service"
    ways = (BY_DEFAULT, "projection", "virtual_work")
    yield Field("/model/compatibility", "Compatibility", "Approaches add up by", group, BY_DEFAULT, blank=free, choices=ways)
    laws = (BY_DEFAULT, *KINDS["/model/stiffness"])
    yield Field("/model/stiffness/law", "StiffnessLaw", "Contact law", group, BY_DEFAULT, blank=free, choices=laws)
    for contact, label in CONTACTS:
        pointer, name = f"/model/stiffness/{contact}_n_per_mm", f"{_named(label)}StiffnessNPerMm"
        label, limits = f"Stiffness, {label.lower()}", STIFFNESS_N_PER_MM
        yield Field(pointer, name, label, group, None, "N/mm", limits, 500000.0)
    for contact, label in CONTACTS:
        pointer, name = f"/model/stiffness/depth_mm/{contact}", f"{_named(label)}Depth"
        yield Field(pointer, name, f"Depth, {label.lower()}", group, 0.0, "mm", LENGTH_MM, blank="tooth radius")
    for contact, label in CONTACTS:
        pointer, name = f"/model/series_compliance_mm_per_n/{contact}", f"{_named(label)}ComplianceMmPerN"
        yield Field(pointer, name, f"Compliance behind, {label.lower()}", group, 0.0, "mm/N", (0.0, 1e3), blank="none")
    yield Field("/model/refinements", "Refinements", "Refinements", group, "auto", blank="by the geometry", choices=("auto", "none"))
    most, blank = 10**7, "50, or by the tolerance"
    yield Field("/sweep/samples", "Samples", "Input angles, intervals", group, 0, limits=(1, most), blank=blank)
    yield Field("/sweep/tolerance", "SweepTolerance", "or to a tolerance", group, 0.0, limits=(1e-12, 0.1), blank="left out")
    yield Field("/sweep/wind_up", "WindUp", "Wind-up too", group, False)


def _friction():
    group, place, kind = "Friction", "/friction/wave_generator", "FrictionKind"
    kinds = tuple(KINDS[place])
    choices = ("none", *kinds)
    yield Field(f"{place}/kind", kind, "Teeth run on", group, choices[0], blank="no friction computed", choices=choices)

    def coefficient(pointer, name, label, start, *where):
        return Field(pointer, name, label, group, limits=SHARE, start=start, shown=(kind, where))

    pointer = f"{place}/coefficient"
    yield coefficient(pointer, "WaveGeneratorFriction", "μ, wave generator", 0.05, "plain", "race")
    yield coefficient("/friction/ring/coefficient", "RingFriction", "μ, ring", 0.05, *kinds)
    yield coefficient("/friction/carrier/coefficient", "CarrierFriction", "μ, carrier", 0.05, *kinds)
    yield coefficient(f"{place}/bearing_coefficient", "BearingFriction", "μ, bearing", 0.0015)
    yield Field(f"{place}/bearing_radius_mm", "BearingRadius", "Bearing's radius", group, None, "mm", LENGTH_MM, 28.0)
    pointer, blank = f"{place}/bearing_load_rating_n", "no life asked for; an eccentric's alone"
    yield Field(pointer, "BearingRatingN", "Bearing's rating C", group, 0.0, "N", (1e-3, 1e12), blank=blank)
    pointer, elements = f"{place}/bearing_element", (BY_DEFAULT, "ball", "roller")
    blank = "left to the service"
    yield Field(pointer, "BearingElement", "What rolls in it", group, BY_DEFAULT, blank=blank, choices=elements)
    for contact, label in CONTACTS:
        pointer, name = f"/friction/wear_rate_mm3_per_nm/{contact}", f"{_named(label)}WearMm3PerNm"
        label, limits, rubs = f"Wear rate, {label.lower()}", (0.0, 1e3), (kind, kinds)
        yield Field(pointer, name, label, group, 0.0, "mm³/(N·m)", limits, blank="none", shown=rubs)


def _modification():
    group, place = "Modification", "/modification"
    for key, name, label in (
        ("ring_equidistant", "RingSetBack", "Ring set back"),
        ("ring_path_shift", "RingPathShift", "Ring's path outward"),
        ("ring_profile_shift", "RingProfileShift", "Ring's profile outward"),
        ("wave_generator_equidistant", "WaveGeneratorSetBack", "Wave generator set back"),
        ("slot_wall", "SlotWallSetBack", "Slot walls set back"),
        ("tooth_radius", "ThinnerTeeth", "Teeth thinner"),
    ):
        yield Field(f"{place}/{key}_um", f"{name}Um", label, group, 0.0, "µm", EITHER_WAY_UM, blank="none")
    for part in ("ring", "carrier"):
        pointer, name = f"{place}/{part}_rotation_arcsec", f"{part.title()}RotationArcsec"
        yield Field(pointer, name, f"{part.title()} turned", group, 0.0, "arcsec", EITHER_WAY_ARCSEC, blank="none")
    relief, place = "TipRelief", f"{place}/ring_tip_relief"
    yield Field(place, relief, "Tip relief of the ring", group, False, is_object=True)
    shown = (relief, (True,))
    yield Field(f"{place}/amount_um", "TipReliefUm", "Relief at the tip", group, None, "µm", EITHER_WAY_UM, 5.0, shown=shown)
    yield Field(f"{place}/start_deg", "TipReliefStart", "from the position", group, None, "deg", (0.0, 180.0), 60.0, shown=shown)
    yield Field(f"{place}/power", "TipReliefPower", "to the power", group, limits=(0.1, 100.0), start=2.0, shown=shown)


def _parts():
    group = "Parts as made"

    def radius(pointer, name, label, blank):
        return Field(f"/parts/{pointer}_radius_mm", name, label, group, 0.0, "mm", LENGTH_MM, blank=blank)

    yield radius("wave_generator/bore", "CamBoreRadius", "Cam's bore, radius", "none")
    yield radius("carrier/inner", "CarrierInnerRadius", "Carrier, inner radius", "a tenth of the room stays free")
    yield radius("carrier/outer", "CarrierOuterRadius", "Carrier, outer radius", "a tenth of the room stays free")
    yield radius("ring/outer", "RingOuterRadius", "Ring, outer radius", "1.2 × root")
    for part, label in PARTS:
        pointer, name = f"/parts/{part}/clearance_um", f"{_named(label)}ClearanceUm"
        yield Field(pointer, name, f"Clearance, {label.lower()}", group, 0.0, "µm", GAP_UM, blank="none")
    yield Field("/profile/chord_tolerance_mm", "ChordTolerance", "Chord tolerance", group, 0.001, "mm", LENGTH_MM)

    group = "Materials"
    for part, label in PARTS:
        place, name = f"/materials/{part}", _named(label)
        pointer = f"{place}/youngs_modulus_gpa"
        yield Field(pointer, f"{name}ModulusGPa", f"E, {label.lower()}", group, 210.0, "GPa", (1e-3, 1e5))
        yield Field(f"{place}/poissons_ratio", f"{name}PoissonsRatio", f"ν, {label.lower()}", group, 0.3, limits=(-1.0, 0.5))

    group = "Parts off the axis"
    for part, label in CONTACTS:
        place, name = f"/deviations/{part}_runout", f"{_named(label)}Runout"
        label = f"{label}, runout"
        yield Field(f"{place}/amount_um", f"{name}Um", label, group, 0.0, "µm", GAP_UM, blank="none")
        yield Field(f"{place}/angle_deg", f"{name}Angle", "in the direction", group, 0.0, "deg", (-360.0, 360.0))

    # What the document has besides: lists, such as a load spectrum or what single teeth were measured to have.
    yield Field("", "OtherFields", "Other fields, as JSON", "Other", "", blank="none")


def _with_kinds(fields):
    """The fields, each shown with the kinds that have it, and those that have no entry."""
    for place, kinds in KINDS.items():
        having, described = {}, {}
        for kind, below in kinds.items():
            for field in below:
                having.setdefault(field["pointer"], []).append(kind)
                described[field["pointer"]] = field
        shown = {pointer: (CHOOSING_KINDS[place], tuple(kinds)) for pointer, kinds in having.items()}
        (group,) = (field.group for field in fields if field.name == CHOOSING_KINDS[place])
        fields = [replace(field, shown=shown.get(field.pointer, field.shown)) for field in fields]
        known = {field.pointer for field in fields}
        # The last field holds what has none.
        fields[-1:-1] = [_unlisted(place, group, field, shown[pointer]) for pointer, field in described.items() if pointer not in known]
    return fields


def _unlisted(place, group, field, shown):
    unit = field.get("unit", "").lower().replace("/", "_per_")
    words = re.sub(f"_{unit}(?=/|$)", "", field["pointer"][len(place) + 1 :]).replace("/", ", ").replace("_", " ").capitalize()
    name = "".join(word.title() for word in words.replace(",", "").split())
    if "choices" in field:
        return Field(field["pointer"], name, words, group, BY_DEFAULT, blank="left out", choices=(BY_DEFAULT, *field["choices"]), shown=shown)
    number = int if field["is_whole"] else float
    limits = (number(field["low"]), number(field["high"]))
    start = max(limits[0], min(number(1), limits[1])) if field["is_required"] else None
    blank = "" if field["is_required"] else "left out"
    return Field(field["pointer"], name, words, group, number(0), field["unit"], limits, start, blank, shown=shown)


FIELDS = tuple(_with_kinds([*_drive(), *_load(), *_model(), *_friction(), *_modification(), *_parts()]))
CHOOSING = tuple(dict.fromkeys(field.shown[0] for field in FIELDS if field.shown))  # names of fields that others depend on
OTHER = FIELDS[-1].name

# The paper's case 5.1, with the values that the fields begin with.
START = {"load": {"input_torque_nm": 20.0}, "model": {"compatibility": "projection", "stiffness": {"law": "linear"}}}


def document_of(values):
    """The design document of the values, by property name. What is not set is left out.

    Raises NoDocument where the other fields are no JSON object, or have what has a field of its own.
    """
    document = {}
    for field in FIELDS:
        value = values[field.name]
        is_set = field.start is not None or value != field.default
        if is_set and field.pointer and field.is_shown(values):
            *parents, key = field.pointer.strip("/").split("/")
            place = document
            for parent in parents:
                place = place.setdefault(parent, {})
            place[key] = {} if field.is_object else FLAGS[value] if field.is_flag else value
    _join(document, others_of(values[OTHER]))
    return document


def others_of(text):
    """The object that the other fields are. Raises NoDocument where they are none."""
    try:
        others = json.loads(text or "{}")
    except ValueError as error:
        raise NoDocument(f"The other fields are no JSON: {error}") from None
    if not isinstance(others, dict):
        raise NoDocument("The other fields are no JSON object")
    return others


def _join(document, others, place=""):
    for key, value in others.items():
        if key not in document:
            document[key] = value
        elif isinstance(value, dict) and isinstance(document[key], dict):
            _join(document[key], value, f"{place}/{key}")
        else:
            raise NoDocument(f"{place}/{key} has a field of its own, and may not stand among the other fields too")


# Properties of drives in files of earlier versions, and where their values stood in the document.
RETIRED = {
    **{f"{_named(label)}GapUm": f"/model/clearance/{contact}_um" for contact, label in CONTACTS},
    "RingTeethBend": "/model/ring_teeth_bend",
    "WaveGeneratorMoves": "/model/wave_generator_moves",
    "CornerContact": "/model/corner_contact",
}


def with_retired(document, values):
    """The document with values of retired properties, by name; those that said nothing are left out."""
    document = json.loads(json.dumps(document))
    for name, value in values.items():
        value = FLAGS.get(value, value) if isinstance(value, str) else value
        if value not in (0.0, BY_DEFAULT) or name != "CornerContact" and value is False:
            *parents, key = RETIRED[name].strip("/").split("/")
            place = document
            for parent in parents:
                place = place.setdefault(parent, {})
            place[key] = value
    return document


def converted(document):
    """The document without the deprecated fields that have a replacement. Gaps that the parts contradict stay, for the service to refuse."""
    model, parts = dict(document.get("model") or {}), dict(document.get("parts") or {})
    gaps = model.pop("clearance", None) or {}
    teeth = (parts.get("teeth") or {}).get("clearance_um", 0.0)
    contradicted = {}
    for part, _ in CONTACTS:
        gap, given = gaps.get(f"{part}_um", 0.0), parts.get(part) or {}
        made = given.get("clearance_um", 0.0) + teeth
        if gap and not made:
            parts[part] = {**given, "clearance_um": gap}
        elif gap and gap != made:
            contradicted[f"{part}_um"] = gap
    if contradicted:
        model["clearance"] = contradicted
    bend, moves, corner = (model.get(key) for key in SWITCHES)
    # Without the geometry nobody knows what is left of `auto` then.
    if not (moves is False and bend is None):
        for key in SWITCHES:
            model.pop(key, None)
        auto = [] if False in (bend, moves) else ["auto"]
        chosen = auto + [key for key, value in zip(SWITCHES, (bend, moves, corner)) if value]
        if chosen != ["auto"]:
            model["refinements"] = chosen or "none"
    kept = {key: value for key, value in document.items() if key not in ("model", "parts")}
    return {**kept, **{key: value for key, value in (("model", model), ("parts", parts)) if value}}


def values_of(document):
    """The values of a design document, by property name; where it has none, what is meant then, or what the field begins with.

    Raises NoDocument where it has a value that its field cannot hold.
    """
    document = converted(document)
    values = {field.name: _value_of(field, _found(document, field.pointer)) for field in FIELDS if field.pointer}
    shown = (field for field in FIELDS if field.pointer and not field.is_object and field.is_shown(values))
    own = {field.pointer for field in shown if field.takes(_found(document, field.pointer))}
    others = _without(document, own)
    values[OTHER] = json.dumps(others, ensure_ascii=False) if others else ""
    return values


def _found(document, pointer):
    for key in pointer.strip("/").split("/"):
        document = document.get(key) if isinstance(document, dict) else None
    return document


def _value_of(field, value):
    if field.is_object:
        return isinstance(value, dict)
    if value is None or not field.takes(value):
        return field.absent
    if field.is_flag and isinstance(value, bool):
        return next(choice for choice, flag in FLAGS.items() if flag is value)
    try:
        held = type(field.absent)(value)
    except (TypeError, ValueError):
        held = None
    if held != value or field.choices and held not in field.choices:
        raise NoDocument(f"{field.pointer}: the field cannot hold {value!r}")
    return held


def _without(document, own, place=""):
    """What of the document has no field of its own."""
    others = {}
    for key, value in document.items():
        pointer = f"{place}/{key}"
        if isinstance(value, dict) and value:
            value = _without(value, own, pointer)
            if not value:
                continue
        elif pointer in own:
            continue
        others[key] = value
    return others


def suited(values, chosen):
    """The values, by the field's name, that go with a choice just made: teeth of the ring, or law and way of adding up."""
    if chosen in ("WaveGeneratorKind", "Lobes"):
        count, lobes = values["ToothCount"], LOBES.get(values["WaveGeneratorKind"], values["Lobes"])
        return {"RingTeeth": count + (lobes if values["RingTeeth"] > count else -lobes)}
    is_ball, law, way = values["ToothShape"] == "ball", values["StiffnessLaw"], values["Compatibility"]
    if law not in (BY_DEFAULT, "fixed") and is_ball != (law == "hertz"):
        law = BY_DEFAULT
    if way == "projection" and (law not in (BY_DEFAULT, *PROJECTED) or is_ball and law != "fixed"):
        law, way = (BY_DEFAULT, way) if chosen == "Compatibility" and not is_ball else (law, "virtual_work")
    return {"StiffnessLaw": law, "Compatibility": way}
