"""Makes the workbench known to FreeCAD, which runs this file at its start."""


class ToothwaveWorkbench(Workbench):  # noqa: F821, FreeCAD provides it
    """Discrete-tooth harmonic drives, calculated by a toothwave service."""

    MenuText = "Toothwave"
    ToolTip = "Discrete-tooth harmonic drives"

    def __init__(self):
        import toothwave_panel

        self.__class__.Icon = toothwave_panel.ICON

    def Initialize(self):
        import FreeCADGui

        import toothwave_panel

        FreeCADGui.addCommand("Toothwave_NewDrive", toothwave_panel.NewDrive())
        self.appendToolbar("Toothwave", ["Toothwave_NewDrive"])
        self.appendMenu("Toothwave", ["Toothwave_NewDrive"])

    def GetClassName(self):
        return "Gui::PythonWorkbench"


FreeCADGui.addWorkbench(ToothwaveWorkbench())  # noqa: F821, FreeCAD provides it
