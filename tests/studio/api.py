"""What tests send to the studio's HTTP API, and where."""

import io

from PIL import Image

API = "/api/v1"


def png(pixels):
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()
