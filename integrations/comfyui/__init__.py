"""relit's nodes for ComfyUI: the light of one face photo on another, lamps by hand, light as a picture."""

from .nodes import FaceLight, RelightByLamp, RelightFromPhoto

NODE_CLASS_MAPPINGS = {
    "RelitRelightFromPhoto": RelightFromPhoto,
    "RelitRelightByLamp": RelightByLamp,
    "RelitFaceLight": FaceLight,
}
NODE_DISPLAY_NAME_MAPPINGS = {
    "RelitRelightFromPhoto": "Relight from Photo",
    "RelitRelightByLamp": "Relight by Lamp",
    "RelitFaceLight": "Light of a Face",
}

__all__ = ["NODE_CLASS_MAPPINGS", "NODE_DISPLAY_NAME_MAPPINGS"]
