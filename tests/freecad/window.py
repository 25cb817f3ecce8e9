"""FreeCAD with its window, as a user has it: what Cancel, Undo and a silent host do. Run by test_window.py, in a process of its own."""

import faulthandler
import os
import socket
import sys
import threading
import unittest

import FreeCAD
import FreeCADGui

FreeCADGui.showMainWindow()  # before whatever asks whether there is one

from PySide import QtCore, QtGui

import toothwave_drive
import toothwave_panel
from service import running_service

OBJECTS = {"Assembly", "HarmonicDrive", "Ring", "Carrier", "Teeth", "WaveGenerator", "Results"}


def setUpModule():
    global url
    url = unittest.enterModuleContext(running_service())
    FreeCADGui.addCommand("Toothwave_NewDrive", toothwave_panel.NewDrive())


class Panel(toothwave_panel.Panel):
    """The dialog, and which one it is that the command or a double click has opened."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        Panel.latest = self


toothwave_panel.Panel = Panel


class Host:
    """A host that takes a request and says nothing until it is told to."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.listener.getsockname()[1]}"
        self.may_answer = threading.Event()
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self.answer, args=(connection,), daemon=True).start()

    def answer(self, connection):
        with connection:
            self.may_answer.wait()
            connection.sendall(b"HTTP/1.1 404 No\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}")

    def close(self):
        self.may_answer.set()
        self.listener.close()


class Window(unittest.TestCase):
    def setUp(self):
        self.document = FreeCAD.newDocument()
        self.addCleanup(self.close)
        toothwave_drive.DEFAULT_URL = url

    def close(self):
        if FreeCADGui.Control.activeDialog():
            self.press(QtGui.QDialogButtonBox.Cancel)
        # The document stays: closing its view takes OpenGL, which not every machine that tests has.

    def new_drive(self):
        """By the command, as from the toolbar."""
        FreeCADGui.runCommand("Toothwave_NewDrive")
        self.assertLessEqual(OBJECTS, set(self.names()))
        return self.document.HarmonicDrive

    def names(self):
        return [obj.Name for obj in self.document.Objects]

    def press(self, button):
        """A button of the task panel that FreeCAD shows."""
        FreeCADGui.updateGui()
        boxes = [widget for widget in QtGui.QApplication.allWidgets() if isinstance(widget, QtGui.QDialogButtonBox)]
        (box,) = (box for box in boxes if box.isVisible() and box.button(QtGui.QDialogButtonBox.Apply))
        box.button(button).click()
        QtGui.QApplication.sendPostedEvents(None, QtCore.QEvent.DeferredDelete)

    def sheet(self):
        """What stands in the spreadsheet, cell by cell."""
        sheet = self.document.Results
        cells = (f"{column}{row}" for column in "ABCDEFGH" for row in range(1, 60))
        return {cell: sheet.get(cell) for cell in cells if sheet.getContents(cell)}

    def enter(self, name, text):
        """Into a field of the task panel."""
        Panel.latest.edits[name].entry.setText(text)


class Steps(Window):
    def test_cancel_takes_a_new_drive_back(self):
        self.new_drive()
        self.press(QtGui.QDialogButtonBox.Cancel)
        self.assertEqual(self.names(), [])
        self.assertFalse(FreeCADGui.Control.activeDialog())
        self.assertEqual(self.document.UndoNames, [])

    def test_cancel_takes_a_new_drive_back_after_apply_too(self):
        self.new_drive()
        self.enter("ToothRadius", "4.5")
        self.press(QtGui.QDialogButtonBox.Apply)
        self.assertEqual(self.document.HarmonicDrive.ToothRadius.Value, 4.5)
        self.press(QtGui.QDialogButtonBox.Cancel)
        self.assertEqual((self.names(), self.document.UndoNames), ([], []))

    def test_one_undo_takes_a_new_drive_back_and_redo_brings_it(self):
        self.new_drive()
        self.press(QtGui.QDialogButtonBox.Ok)
        self.assertEqual(self.document.UndoNames, ["New harmonic drive"])
        self.document.undo()
        self.assertEqual(self.names(), [])
        self.document.redo()
        self.assertLessEqual(OBJECTS, set(self.names()))
        self.document.HarmonicDrive.ToothWidth = 12
        self.document.recompute()
        self.assertAlmostEqual(self.document.Ring.Shape.BoundBox.ZMax, 12)

    def test_cancel_and_undo_take_an_edit_back_and_leave_the_drive(self):
        drive = self.new_drive()
        self.press(QtGui.QDialogButtonBox.Ok)
        for button, undo in ((QtGui.QDialogButtonBox.Cancel, None), (QtGui.QDialogButtonBox.Ok, self.document.undo)):
            drive.ViewObject.doubleClicked()
            self.enter("ToothWidth", "12")
            self.press(QtGui.QDialogButtonBox.Apply)
            self.assertAlmostEqual(self.document.Ring.Shape.BoundBox.ZMax, 12)
            self.press(button)
            if undo:
                self.assertEqual(self.document.UndoNames, ["Edit harmonic drive", "New harmonic drive"])
                undo()
                self.document.recompute()
            self.assertEqual(drive.ToothWidth.Value, 15)
            self.assertAlmostEqual(self.document.Ring.Shape.BoundBox.ZMax, 15)


    def test_cancel_and_undo_take_another_kind_back_with_its_fields(self):
        drive = self.new_drive()
        self.press(QtGui.QDialogButtonBox.Ok)
        sheet = self.sheet()
        for button, undo in ((QtGui.QDialogButtonBox.Cancel, None), (QtGui.QDialogButtonBox.Ok, self.document.undo)):
            drive.ViewObject.doubleClicked()
            entry = Panel.latest.edits["WaveGeneratorKind"].entry
            entry.setCurrentIndex(entry.findData("eccentric"))
            entry.activated.emit(entry.currentIndex())
            FreeCADGui.updateGui()
            shown = {name: edit.isVisible() for name, edit in Panel.latest.edits.items()}
            self.assertEqual((shown["SemiMajor"], shown["Eccentricity"]), (False, True))
            self.press(QtGui.QDialogButtonBox.Apply)
            self.assertEqual((drive.Problem, drive.WaveGeneratorKind, drive.RingTeeth), ("", "eccentric", 27))
            self.assertEqual((drive.getEditorMode("SemiMajor"), drive.getEditorMode("Eccentricity")), (["Hidden"], []))
            self.press(button)
            if undo:
                undo()
                self.document.recompute()
            self.assertEqual((drive.WaveGeneratorKind, drive.RingTeeth), ("ellipse", 26))
            self.assertEqual(self.sheet(), sheet)
            self.assertEqual((drive.getEditorMode("SemiMajor"), drive.getEditorMode("Eccentricity")), ([], ["Hidden"]))

    def test_a_new_drive_has_icon_and_colours(self):
        drive = self.new_drive()
        self.assertIsInstance(drive.ViewObject.Proxy, toothwave_panel.ViewDrive)
        for part, name in toothwave_drive.PARTS.items():
            colour = self.document.getObject(name).ViewObject.ShapeColor[:3]
            for found, expected in zip(colour, toothwave_panel.COLOURS[part]):
                self.assertAlmostEqual(found, expected, 2)


class Silence(Window):
    def setUp(self):
        super().setUp()
        self.host = Host()
        self.addCleanup(self.host.close)

    def test_while_a_host_is_silent_the_window_goes_on(self):
        drive = self.new_drive()
        beats = []

        def beat():  # in the window's thread: only if that is free does the host ever answer
            beats.append(len(beats))
            if len(beats) == 5:
                self.host.may_answer.set()

        timer = QtCore.QTimer(interval=1)
        timer.timeout.connect(beat)
        drive.ServiceUrl = self.host.url
        timer.start()
        self.document.recompute()
        timer.stop()
        self.assertGreaterEqual(len(beats), 5)
        self.assertIn("404", drive.Problem)

    def test_a_silent_host_can_be_given_up(self):
        drive = self.new_drive()
        seen = []

        def give_up():
            for dialog in QtGui.QApplication.topLevelWidgets():
                if isinstance(dialog, QtGui.QProgressDialog) and dialog.isVisible():
                    seen.append(dialog.isModal())
                    dialog.findChild(QtGui.QPushButton).click()

        timer = QtCore.QTimer(interval=10)
        timer.timeout.connect(give_up)
        drive.ServiceUrl = self.host.url
        timer.start()
        self.document.recompute()
        timer.stop()
        self.assertEqual(seen, [True])
        self.assertEqual(drive.Problem, "The toothwave service was not waited for")
        self.assertIn("Invalid", drive.State)
        self.assertFalse(self.host.may_answer.is_set())


if __name__ == "__main__":
    faulthandler.dump_traceback_later(180, exit=True, file=sys.__stderr__)  # of a dialog that nobody closes
    succeeded = unittest.main(exit=False).result.wasSuccessful()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(not succeeded)  # FreeCAD's window crashes when Python takes itself down around it
