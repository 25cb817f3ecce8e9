"""The design document as a table of fields: what the object's properties and the dialog are made of. No FreeCAD here."""

from dataclasses import dataclass

CONTACTS = (("wave_generator", "Wave generator"), ("teeth", "Teeth"), ("ring", "Ring"), ("carrier", "Carrier"))


@dataclass(frozen=True)
class Field:
    """One value of the document. Lengths in mm and angles in degrees become quantities; other units stand in the name."""

    pointer: str
    name: str
    label: str
    group: str
    default: object
    unit: str = ""
    blank: str = ""  # what 0 stands for, where the document leaves the field out then
    choices: tuple = ()

    @property
    def tooltip(self):
        """Where the value stands in the document, and what its 0 means."""
        return self.pointer + (f"\n0: {self.blank}" if self.blank else "")


def _fields():
    group = "Drive"
    yield Field("/drive/wave_generator/semi_major_mm", "SemiMajor", "Semi-major axis a", group, 58.0, "mm")
    yield Field("/drive/wave_generator/semi_minor_mm", "SemiMinor", "Semi-minor axis b", group, 56.0, "mm")
    yield Field("/drive/teeth/count", "ToothCount", "Teeth in theory", group, 28)
    yield Field("/drive/teeth/installed", "InstalledTeeth", "Teeth installed", group, 0, blank="all")
    yield Field("/drive/teeth/radius_mm", "ToothRadius", "Tooth radius r", group, 5.0, "mm")
    yield Field("/drive/teeth/width_mm", "ToothWidth", "Tooth width", group, 15.0, "mm")
    yield Field("/drive/ring/teeth", "RingTeeth", "Ring teeth", group, 26)
    yield Field("/drive/ring/tip_radius_mm", "TipRadius", "Ring's tip bored to", group, 0.0, "mm", "natural tip")

    group = "Assembly"
    yield Field("/assembly/input_angle_deg", "InputAngle", "Input angle", group, 0.0, "deg")

    group = "Load and model"
    yield Field("/load/input_torque_nm", "InputTorqueNm", "Input torque", group, 20.0, "N·m", "left out")
    yield Field("/load/output_torque_nm", "OutputTorqueNm", "or output torque", group, 0.0, "N·m", "left out")
    yield Field("/load/allowable_stress_mpa", "AllowableStressMPa", "Allowable stress", group, 0.0, "MPa", "not asked")
    ways = ("virtual_work", "projection")
    yield Field("/model/compatibility", "Compatibility", "Approaches add up by", group, ways[0], choices=ways)
    laws = ("johnson", "palmgren", "fixed", "linear")
    yield Field("/model/stiffness/law", "StiffnessLaw", "Contact law", group, laws[0], choices=laws)
    for contact, label in (CONTACTS[0], *CONTACTS[2:]):
        name = label.title().replace(" ", "")
        pointer = f"/model/stiffness/{contact}_n_per_mm"
        yield Field(pointer, f"{name}StiffnessNPerMm", f"Stiffness, {label.lower()}", group, 0.0, "N/mm", "left out")
    for contact, label in (CONTACTS[0], *CONTACTS[2:]):
        name = label.title().replace(" ", "")
        yield Field(f"/model/clearance/{contact}_um", f"{name}GapUm", f"Gap, {label.lower()}", group, 0.0, "µm", "none")
    yield Field("/sweep/samples", "Samples", "Input angles, intervals", group, 0, blank="50, or by the tolerance")
    yield Field("/sweep/tolerance", "SweepTolerance", "or to a tolerance", group, 0.0, blank="left out")
    yield Field("/sweep/wind_up", "WindUp", "Wind-up too", group, False)

    group = "Parts as made"
    yield Field("/parts/wave_generator/bore_radius_mm", "CamBoreRadius", "Cam's bore, radius", group, 0.0, "mm", "none")
    yield Field("/parts/carrier/inner_radius_mm", "CarrierInnerRadius", "Carrier, inner radius", group, 0.0, "mm", "default")
    yield Field("/parts/carrier/outer_radius_mm", "CarrierOuterRadius", "Carrier, outer radius", group, 0.0, "mm", "default")
    yield Field("/parts/ring/outer_radius_mm", "RingOuterRadius", "Ring, outer radius", group, 0.0, "mm", "1.2 × root")
    for part, label in CONTACTS:
        name = label.title().replace(" ", "")
        yield Field(f"/parts/{part}/clearance_um", f"{name}ClearanceUm", f"Clearance, {label.lower()}", group, 0.0, "µm", "none")
    yield Field("/profile/chord_tolerance_mm", "ChordTolerance", "Chord tolerance", group, 0.001, "mm")

    group = "Materials"
    for part, label in CONTACTS:
        name = label.title().replace(" ", "")
        yield Field(f"/materials/{part}/youngs_modulus_gpa", f"{name}ModulusGPa", f"E, {label.lower()}", group, 210.0, "GPa")
        yield Field(f"/materials/{part}/poissons_ratio", f"{name}PoissonsRatio", f"ν, {label.lower()}", group, 0.3)


FIELDS = tuple(_fields())


def document_of(values):
    """The design document of the values, by property name. A 0 that stands for nothing is left out."""
    document = {}
    for field in FIELDS:
        value = values[field.name]
        if field.blank and value == 0:
            continue
        *parents, key = field.pointer.strip("/").split("/")
        place = document
        for parent in parents:
            place = place.setdefault(parent, {})
        place[key] = value
    return document


def values_of(document):
    """The values of a design document, by property name: defaults where it has none."""
    values = {}
    for field in FIELDS:
        value = document
        for key in field.pointer.strip("/").split("/"):
            value = value.get(key) if isinstance(value, dict) else None
        if value is None:
            # A default load beside one that is given, or a law's stiffness, would be another design.
            value = type(field.default)() if field.blank else field.default
            if field.name == "StiffnessLaw" and values["Compatibility"] == "projection":
                value = "linear"  # what the service takes then
        values[field.name] = type(field.default)(value)
    return values
