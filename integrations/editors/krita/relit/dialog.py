"""The dialog: which light, and how much of it."""

from krita import Krita

from .qt import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QLineEdit,
    QMessageBox,
    QPushButton,
)
from .relit_command import FROM_PHOTO, LIGHTS, SLIDERS, Wanted

_GROUP, _COMMAND, _PHOTO = "relit", "command", "reference"  # where Krita keeps what was chosen last


class RelightDialog(QDialog):
    """Asks for a photo or a light, and for the numbers."""

    def __init__(self, parent=None):
        super().__init__(parent)
        self.setWindowTitle("Relight Face")
        krita = Krita.instance()
        self.photo = QLineEdit(krita.readSetting(_GROUP, _PHOTO, ""))
        browse = QPushButton("Choose...")
        browse.clicked.connect(self._choose)
        self.light = QComboBox()
        for light in (FROM_PHOTO, *LIGHTS):
            self.light.addItem("That of the photo" if light == FROM_PHOTO else light.capitalize(), light)
        self.numbers = {slider.name: self._number(slider) for slider in SLIDERS}
        self.command = QLineEdit(krita.readSetting(_GROUP, _COMMAND, ""))
        self.command.setPlaceholderText("where relit is; empty if the installation knows")
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        form = QFormLayout(self)
        form.addRow("Light", self.light)
        form.addRow("Photo that gives it", self.photo)
        form.addRow("", browse)
        for slider in SLIDERS:
            form.addRow(slider.title, self.numbers[slider.name])
        form.addRow("Command", self.command)
        form.addRow(buttons)

    def wanted(self):
        """Return what was asked for, and keep the photo and the command for the next time."""
        krita, light = Krita.instance(), self.light.currentData()
        krita.writeSetting(_GROUP, _PHOTO, self.photo.text())
        krita.writeSetting(_GROUP, _COMMAND, self.command.text())
        return Wanted(
            self.photo.text().strip() or None,
            None if light == FROM_PHOTO else light,
            {name: number.value() for name, number in self.numbers.items()},
            self.command.text(),
        )

    def _choose(self):
        path, _ = QFileDialog.getOpenFileName(self, "Photo that gives the light", self.photo.text())
        if path:
            self.photo.setText(path)
            self.light.setCurrentIndex(0)

    @staticmethod
    def _number(slider):
        box = QDoubleSpinBox()
        box.setRange(slider.least, slider.most)
        box.setSingleStep(1.0 if slider.most > 10 else 0.05)
        box.setValue(slider.default)
        return box


def ask():
    """Return what is wanted, or None if the dialog was cancelled."""
    dialog = RelightDialog()
    return dialog.wanted() if dialog.exec() else None


def tell(message):
    """Show one line on what went wrong."""
    QMessageBox.warning(None, "relit", message)
