"""relit for Krita: the face in a picture in another light, on a layer with a mask."""

from krita import Krita

from .extension import RelitExtension

Krita.instance().addExtension(RelitExtension(Krita.instance()))
