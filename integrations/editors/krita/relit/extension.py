"""The menu's entry, and what it does."""

import struct
import tempfile

from krita import Extension, InfoObject, Krita, Selection

from .dialog import ask, tell
from .qt import QByteArray, QImage
from .relit_command import Files, RelitError, relight

#: How an opaque pixel's alpha is stored, by the name of the depth.
_OPAQUE = {
    "U8": b"\xff",
    "U16": b"\xff\xff",
    "F16": struct.pack("<e", 1.0),
    "F32": struct.pack("<f", 1.0),
}


class RelitExtension(Extension):
    """The plug-in, as Krita asks for it."""

    def setup(self):
        """Krita calls this once; there is nothing to do."""

    def createActions(self, window):
        """Add the menu's entry."""
        window.createAction("relit_relight", "Relight Face...", "tools/scripts").triggered.connect(self.run)

    def run(self):
        """Ask, relight, and put the result on top of the picture."""
        document = Krita.instance().activeDocument()
        if document is None:
            tell("Open a picture with a face first.")
            return
        wanted = ask()
        if wanted is None:
            return
        try:
            relight_document(document, wanted)
        except (RelitError, OSError) as error:
            tell(str(error))


def relight_document(document, wanted):
    """Put a document's face in another light, on a layer with a mask; return the layer.

    Raises
    ------
    RelitError
        If that fails, in one line.
    """
    with tempfile.TemporaryDirectory() as folder:
        files = Files.within(folder)
        _export(document, str(files.target))
        relight(wanted, files)
        return _insert(document, str(files.result), str(files.mask))


def _export(document, path):
    """Write what is seen of a document as PNG; the document stays as it is."""
    copy = document.clone()
    try:
        copy.setBatchmode(True)  # or it asks how to write the file
        if not copy.exportImage(path, InfoObject()):
            raise RelitError("Krita could not export the picture as PNG; is there room on the disk?")
    finally:
        copy.close()


def _insert(document, result, mask):
    """Put a photo on top of a document, with its mask."""
    width, height = document.width(), document.height()
    layer = document.createNode("Relit", "paintlayer")
    pixels, white = _pixels(document, result), _white(mask)
    # From Krita 5.2; before, the layer's own alpha will do.
    masked = hasattr(document, "createTransparencyMask")
    if not masked:
        pixels = _seen_through(pixels, white, document.colorDepth())
    layer.setPixelData(QByteArray(pixels), 0, 0, width, height)
    document.rootNode().addChildNode(layer, None)
    if masked:
        changed = document.createTransparencyMask("Changed")
        layer.addChildNode(changed, None)
        selection = Selection()
        selection.setPixelData(QByteArray(white), 0, 0, width, height)
        changed.setSelection(selection)
    document.refreshProjection()
    return layer


def _pixels(document, path):
    """Return a photo's pixels as the document has its own: in its colours and depth."""
    krita = Krita.instance()
    quiet = krita.batchmode()
    krita.setBatchmode(True)  # or it asks how to open 16 bits
    photo = krita.openDocument(path)
    krita.setBatchmode(quiet)
    if photo is None:
        raise RelitError(
            "Krita could not open what relit wrote; install the plug-in and relit anew, both alike."
        )
    try:
        photo.setColorSpace(document.colorModel(), document.colorDepth(), document.colorProfile())
        photo.waitForDone()
        return bytes(photo.pixelData(0, 0, document.width(), document.height()))
    finally:
        photo.close()


def _white(path):
    """Return how white a picture is, one byte for each pixel."""
    picture = QImage(path).convertToFormat(QImage.Format.Format_Grayscale8)
    width, stride = picture.width(), picture.bytesPerLine()
    bits = picture.constBits()
    bits.setsize(stride * picture.height())
    rows = bytes(bits)
    return b"".join(rows[start : start + width] for start in range(0, len(rows), stride))


def _seen_through(pixels, white, depth):
    """Return pixels that are transparent where a mask, black or white, is black; alpha comes last."""
    opaque, size = _OPAQUE[depth], len(pixels) // len(white)
    seen = bytearray(pixels)
    for place, byte in enumerate(opaque, size - len(opaque)):
        seen[place::size] = white.translate(bytes(255) + bytes([byte]))
    return bytes(seen)
