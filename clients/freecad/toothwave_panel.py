"""The dialog: the design's fields in FreeCAD's task panel, with what the service says of them beside the fields it names."""

import concurrent.futures
import math
import os
import threading

import FreeCAD
import FreeCADGui
from PySide import QtCore, QtGui

import toothwave_client
import toothwave_design
import toothwave_drive

ICON = os.path.join(os.path.dirname(__file__), "toothwave.svg")
AT_FAULT = "border: 1px solid #c0392b; border-radius: 2px;"
PROBLEM, FINDING = "#c0392b", "#b9770e"
COLOURS = {
    "ring": (0.55, 0.62, 0.70),
    "carrier": (0.93, 0.72, 0.33),
    "teeth": (0.94, 0.95, 0.96),
    "wave_generator": (0.33, 0.62, 0.84),
}
AT_ONCE_S, SOON_MS, LOOK_MS = 0.05, 500, 20  # an answer from the cache; one that needs no word; how often to look for it


class FieldEdit(QtGui.QWidget):
    """One field: label, entry, unit, and below them what the service objects to."""

    def __init__(self, field):
        super().__init__()
        self.field = field
        self.is_shown = True
        self.entry = self._new_entry()
        self.entry.setToolTip(field.tooltip)
        self.note = QtGui.QLabel(wordWrap=True, visible=False)
        self.note.setStyleSheet(f"color: {PROBLEM}")
        grid = QtGui.QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.addWidget(QtGui.QLabel(field.label, wordWrap=True), 0, 0)
        grid.addWidget(self.entry, 0, 1)
        grid.addWidget(QtGui.QLabel(field.unit.replace("deg", "°"), minimumWidth=32), 0, 2)
        grid.addWidget(self.note, 1, 0, 1, 3)
        grid.setColumnStretch(0, 3)
        grid.setColumnStretch(1, 2)

    def _new_entry(self):
        if self.field.choices:
            entry = QtGui.QComboBox()
            for choice in self.field.choices:
                entry.addItem(choice.replace("_", " "), choice)
            entry.wheelEvent = QtGui.QWheelEvent.ignore  # scrolling the panel would change the design
        elif isinstance(self.field.absent, bool):
            entry = QtGui.QCheckBox()
        else:
            entry = QtGui.QLineEdit(placeholderText=self.field.blank, alignment=QtCore.Qt.AlignRight)
        entry.setMinimumWidth(60)
        entry.setSizePolicy(QtGui.QSizePolicy.Ignored, QtGui.QSizePolicy.Fixed)  # else it is wider than the panel
        return entry

    def show_value(self, value):
        """Shows a property's value; one that stands for nothing as its meaning."""
        value = getattr(value, "Value", value)
        if self.field.choices:
            self.entry.setCurrentIndex(self.field.choices.index(value))
        elif isinstance(value, bool):
            self.entry.setChecked(value)
        elif self.field.blank and value == self.field.default:
            self.entry.setText("")
        else:
            self.entry.setText(value if isinstance(value, str) else _digits(value))

    def value(self):
        """The value entered. Raises ValueError, which says what is wanted, where it is none."""
        if self.field.choices:
            return self.entry.itemData(self.entry.currentIndex())
        if isinstance(self.field.absent, bool):
            return self.entry.isChecked()
        text = self.entry.text().strip()
        if not text and self.field.default is not None:
            return self.field.default
        if isinstance(self.field.absent, str):
            toothwave_design.others_of(text)
            return text
        try:
            value = type(self.field.absent)(text.replace(",", "."))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise ValueError("a whole number is wanted here" if isinstance(self.field.absent, int) else "a number is wanted here")
        if not self.field.takes(value):
            raise ValueError("{:g} to {:g} is wanted here: FreeCAD's angles end at a turn".format(*self.field.held))
        return value

    def object_to(self, text):
        """Marks the field; an empty text takes the mark away."""
        self.note.setText(text)
        self.note.setVisible(bool(text))
        self.entry.setStyleSheet(AT_FAULT if text else "")


def _digits(value):
    """A number in as few digits as tell it from all others."""
    text = f"{value:.15g}"
    return text if float(text) == value else repr(value)


class Panel:
    """FreeCAD's task panel for one drive. Apply recomputes; Cancel takes everything back, a new drive as a whole."""

    is_open = False

    def __init__(self, drive, is_new=False):
        self.drive = drive
        self.edits = {field.name: FieldEdit(field) for field in toothwave_design.FIELDS}
        groups = dict.fromkeys(field.group for field in toothwave_design.FIELDS)
        self.form = [self._service_box(), *map(self._group_box, groups)]
        self._show_properties()
        self._follow_choices()
        self._show_outcome()
        if not is_new:  # else the transaction that made it is still open, and opening another would close it
            open_transaction("Edit harmonic drive")
        Panel.is_open = True

    # --- What it looks like

    def _service_box(self):
        box = QtGui.QWidget(windowTitle="Service")
        self.url = QtGui.QLineEdit(self.drive.ServiceUrl)
        self.examples = QtGui.QComboBox()
        self.examples.addItem("Start from an example…")
        self.examples.wheelEvent = QtGui.QWheelEvent.ignore
        self.examples.activated.connect(self._take_example)
        self.url.editingFinished.connect(self._list_examples)
        self.outcome, self.stresses = (
            QtGui.QLabel(wordWrap=True, textInteractionFlags=QtCore.Qt.TextSelectableByMouse) for _ in range(2)
        )
        column = QtGui.QVBoxLayout(box)
        for widget in (self.url, self.examples, self.outcome, self.stresses):
            widget.setMinimumWidth(60)
            column.addWidget(widget)
        self._list_examples()
        return box

    def _group_box(self, group):
        box = QtGui.QWidget(windowTitle=group)
        column = QtGui.QVBoxLayout(box)
        for edit in self.edits.values():
            if edit.field.group == group:
                column.addWidget(edit)
        if group == "Assembly":
            self.slider = QtGui.QSlider(QtCore.Qt.Horizontal, maximum=720, toolTip="Turns the drive: a turn of the input")
            self._show_angle()
            self.slider.valueChanged.connect(self._turn)
            column.addWidget(self.slider)
        return box

    def _show_angle(self):
        self.slider.blockSignals(True)  # it shows the angle here, and does not set it
        self.slider.setValue(round(2 * (self.drive.InputAngle.Value % 360)))
        self.slider.blockSignals(False)

    def _show_properties(self):
        for name, edit in self.edits.items():
            edit.show_value(getattr(self.drive, name))

    def _follow_choices(self):
        """Shows the fields of the chosen kinds, and from here on of those that will be; what must suit a new kind is made to."""
        for name in toothwave_design.CHOOSING:
            entry = self.edits[name].entry
            (entry.currentIndexChanged if self.edits[name].field.choices else entry.toggled).connect(self._show_fields)
        for name in ("WaveGeneratorKind", "ToothShape", "StiffnessLaw", "Compatibility"):
            self.edits[name].entry.activated.connect(lambda _index, name=name: self._suit(name))
        self.edits["Lobes"].entry.editingFinished.connect(lambda: self._suit("Lobes"))
        self._show_fields()

    def _show_fields(self):
        choices = {name: self.edits[name].value() for name in toothwave_design.CHOOSING}
        for edit in self.edits.values():
            edit.is_shown = edit.field.is_shown(choices)
            edit.setVisible(edit.is_shown)

    def _suit(self, chosen):
        values = {}
        for name, edit in self.edits.items():
            try:
                values[name] = edit.value()
            except ValueError:
                values[name] = 0
        if values["Lobes"] > 0 and values["ToothCount"] > 0:
            for name, value in toothwave_design.suited(values, chosen).items():
                self.edits[name].show_value(value)

    def _show_outcome(self):
        """The problem, or the findings, and the peaks where there are any."""
        problem, sweep = self.drive.Proxy.problem, self.drive.Proxy.sweep
        faults = {error["pointer"]: error["detail"] for error in getattr(problem, "errors", ())}
        for edit in self.edits.values():
            edit.object_to(faults.get(edit.field.pointer, ""))
        findings = ["• " + finding["detail"] for finding in self.drive.Proxy.findings()]
        self._say(str(problem or "\n".join(findings)), PROBLEM if problem else FINDING)
        peaks = sweep["peaks"].items() if sweep and not problem else ()
        lines = [f"Stress at {name.replace('_', ' ')} up to {peak['stress_mpa']['value']:.1f} MPa" for name, peak in peaks]
        self.stresses.setText("\n".join(lines))
        self.stresses.setVisible(bool(lines))

    def _say(self, text, colour):
        self.outcome.setText(text)
        self.outcome.setVisible(bool(text))
        self.outcome.setStyleSheet(f"color: {colour}")

    # --- What it does

    def _list_examples(self):
        self.examples.blockSignals(True)
        while self.examples.count() > 1:
            self.examples.removeItem(1)
        try:
            self.examples.addItems(toothwave_drive.service_at(self.url.text()).examples())
        except toothwave_drive.OBJECTIONS as problem:
            self._say(str(problem), PROBLEM)
        self.examples.blockSignals(False)

    def _take_example(self, index):
        if index > 0:
            try:
                document = toothwave_drive.service_at(self.url.text()).example(self.examples.itemText(index))
                values = toothwave_design.values_of(document)
            except toothwave_drive.OBJECTIONS as problem:
                self._say(str(problem), PROBLEM)
                return
            for name, value in values.items():
                self.edits[name].show_value(value)
            self.apply()

    def _turn(self, half_degrees):
        self.edits["InputAngle"].show_value(half_degrees / 2)
        self.drive.InputAngle = half_degrees / 2
        self.drive.Document.recompute()

    def apply(self):
        """Gives the drive what was entered and recomputes; tells whether it can be drawn."""
        values, is_readable = {}, True
        for name, edit in self.edits.items():
            edit.object_to("")
            if not edit.is_shown:
                continue
            try:
                values[name] = edit.value()
            except ValueError as error:
                edit.object_to(str(error))
                is_readable = False
        if not is_readable:
            return False
        self.drive.ServiceUrl = self.url.text()
        for name, value in values.items():
            if getattr(getattr(self.drive, name), "Value", getattr(self.drive, name)) != value:
                setattr(self.drive, name, value)
        self.drive.touch()  # asks again where only the service has changed, such as from absent to present
        self.drive.Document.recompute()
        self._show_angle()
        self._show_outcome()
        return "Invalid" not in self.drive.State

    # --- As FreeCAD calls it

    def getStandardButtons(self):
        return int(QtGui.QDialogButtonBox.Ok | QtGui.QDialogButtonBox.Apply | QtGui.QDialogButtonBox.Cancel)

    def clicked(self, button):
        if button == QtGui.QDialogButtonBox.Apply:
            self.apply()

    def accept(self):
        if not self.apply():
            return False
        FreeCAD.closeActiveTransaction()
        return self._close()

    def reject(self):
        document = self.drive.Document  # a new drive is no more after the next line
        FreeCAD.closeActiveTransaction(True)
        document.recompute()
        return self._close()

    def _close(self):
        Panel.is_open = False
        FreeCADGui.ActiveDocument.resetEdit()
        FreeCADGui.Control.closeDialog()
        return True


class ViewDrive(toothwave_drive.Stateless):
    """The drive in the tree: its icon, and the dialog on a double click."""

    def __init__(self, view):
        view.Proxy = self

    def getIcon(self):
        return ICON

    def setEdit(self, view, _mode):
        FreeCADGui.Control.showDialog(Panel(view.Object))
        return True

    def unsetEdit(self, _view, _mode):
        FreeCADGui.Control.closeDialog()
        return True

    def doubleClicked(self, view):
        return self.setEdit(view, 0)


class NewDrive:
    """The command: a drive in the active document, and its dialog."""

    def GetResources(self):
        return {
            "Pixmap": ICON,
            "MenuText": "New harmonic drive",
            "ToolTip": "A discrete-tooth harmonic drive, its parts as solids",
        }

    def IsActive(self):
        return not FreeCADGui.Control.activeDialog()

    def Activated(self):
        document = FreeCAD.ActiveDocument or FreeCAD.newDocument("HarmonicDrive")
        open_transaction("New harmonic drive")
        drive = toothwave_drive.make_drive(document=document)
        document.recompute()
        FreeCADGui.activeDocument().activeView().viewIsometric()
        FreeCADGui.SendMsgToActiveView("ViewFit")
        FreeCADGui.Control.showDialog(Panel(drive, is_new=True))


def open_transaction(name):
    """What is done from here on is one step, undone by one Undo or by Cancel. It outlives the command that opens it."""
    FreeCAD.setActiveTransaction(name, True)


def patiently(call):
    """What a call gives. The window goes on being drawn; where the call takes long, a dialog offers to give it up."""
    outcome = concurrent.futures.Future()

    def run():
        try:
            outcome.set_result(call())
        except BaseException as error:  # goes on in the thread that waits
            outcome.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    concurrent.futures.wait([outcome], AT_ONCE_S)
    if outcome.done():
        return outcome.result()
    loop = QtCore.QEventLoop()
    look, soon = QtCore.QTimer(interval=LOOK_MS), QtCore.QTimer(interval=SOON_MS, singleShot=True)
    look.timeout.connect(lambda: outcome.done() and loop.quit())
    soon.timeout.connect(loop.quit)
    look.start()
    soon.start()
    # Nothing can be clicked until the dialog is there, which then bars all else: the design must not change under way.
    loop.exec_(QtCore.QEventLoop.ExcludeUserInputEvents)
    if not outcome.done():
        dialog = QtGui.QProgressDialog("Waiting for the toothwave service…", "Give up", 0, 0, FreeCADGui.getMainWindow())
        dialog.setWindowModality(QtCore.Qt.ApplicationModal)
        dialog.canceled.connect(loop.quit)
        dialog.show()
        loop.exec_()
        dialog.hide()
        dialog.deleteLater()
    if not outcome.done():  # given up; the thread ends by itself, at its own time limit
        raise toothwave_client.NoService("The toothwave service was not waited for")
    return outcome.result()


class Window:
    """FreeCAD's window, as the drive needs it."""

    def wait(self, call):
        """Makes a call to a service; the window goes on being drawn, and the call can be given up."""
        return patiently(call)

    def show(self, problem):
        """A message when the recomputation is over; the dialog, where it is open, shows it itself."""
        title, _, text = problem.partition("\n")

        def show():
            box = QtGui.QMessageBox(QtGui.QMessageBox.Critical, "Toothwave", title, parent=FreeCADGui.getMainWindow())
            box.setInformativeText(text)
            box.exec_()

        if not Panel.is_open:
            QtCore.QTimer.singleShot(0, show)

    def dress(self, drive, parts):
        """Icon and colours, which only exist where there is a window."""
        ViewDrive(drive.ViewObject)
        drive.ViewObject.Visibility = True  # there is nothing to see of it, but grey in the tree looks switched off
        for part in parts:
            view = part.ViewObject
            view.Proxy = 0  # shows a shape as FreeCAD does
            view.ShapeColor = COLOURS[part.DrivePart]
            view.LineWidth = 1
            view.Deviation, view.AngularDeflection = 0.02, 5


if FreeCAD.GuiUp:
    toothwave_drive.window = Window()
