"""Qt as Krita has it: 5, or 6 from Krita 6 on."""

try:
    from PyQt6.QtCore import QByteArray
    from PyQt6.QtGui import QImage
    from PyQt6.QtWidgets import (
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
except ImportError:
    from PyQt5.QtCore import QByteArray
    from PyQt5.QtGui import QImage
    from PyQt5.QtWidgets import (
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

__all__ = [
    "QByteArray",
    "QComboBox",
    "QDialog",
    "QDialogButtonBox",
    "QDoubleSpinBox",
    "QFileDialog",
    "QFormLayout",
    "QImage",
    "QLineEdit",
    "QMessageBox",
    "QPushButton",
]
