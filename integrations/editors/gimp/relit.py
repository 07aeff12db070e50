#!/usr/bin/env python3
"""relit for GIMP 3: the face in an image in another light, on a layer with a mask.

GIMP looks for it at ``plug-ins/relit/relit.py``, executable; ``install.py`` puts it there.
"""

import sys
import tempfile

import gi

gi.require_version("Gimp", "3.0")
gi.require_version("GimpUi", "3.0")

from gi.repository import Gimp, GimpUi, Gio, GLib, GObject  # noqa: E402 (versions come first)
from relit_command import (  # noqa: E402 (beside this file)
    FROM_PHOTO,
    LIGHTS,
    SLIDERS,
    Files,
    RelitError,
    Wanted,
    relight,
)

_PROCEDURE = "relit-relight-face"
_FLAGS = GObject.ParamFlags.READWRITE


class Relit(Gimp.PlugIn):
    """The plug-in, as GIMP asks for it."""

    def do_query_procedures(self):
        """Return the names of what there is."""
        return [_PROCEDURE]

    def do_set_i18n(self, _name):
        """Return that there are no translations."""
        return False

    def do_create_procedure(self, name):
        """Return what GIMP needs to show the menu's entry and the dialog."""
        procedure = Gimp.ImageProcedure.new(self, name, Gimp.PDBProcType.PLUGIN, self.run, None)
        procedure.set_image_types("RGB*, GRAY*")
        procedure.set_menu_label("_Relight Face...")
        procedure.add_menu_path("<Image>/Filters/Light and Shadow/")
        procedure.set_documentation(
            "Put the face in another light, on a layer of its own",
            "By the light of the face in a photo, or by a light that portraitists know by name. "
            "The layer's mask is white where the image was changed.",
            name,
        )
        procedure.set_attribution("The relit developers", "The relit developers, MIT", "2026")
        procedure.add_file_argument(
            "reference",
            "_Photo that gives the light",
            "With the face in the light that is wanted",
            Gimp.FileChooserAction.OPEN,
            True,
            None,
            _FLAGS,
        )
        lights = Gimp.Choice.new()
        for number, light in enumerate((FROM_PHOTO, *LIGHTS)):
            lights.add(light, number, "That of the photo" if light == FROM_PHOTO else light.capitalize(), "")
        procedure.add_choice_argument(
            "light", "_Light", "That of the photo, or one by name", lights, FROM_PHOTO, _FLAGS
        )
        for slider in SLIDERS:
            procedure.add_double_argument(
                slider.name, slider.title, slider.title, slider.least, slider.most, slider.default, _FLAGS
            )
        procedure.add_string_argument(
            "command", "_Command", "Where relit is; empty if the installation knows", "", _FLAGS
        )
        return procedure

    def run(self, procedure, run_mode, image, _drawables, config, _data):
        """Ask, relight, and put the result on top of the image."""
        if run_mode == Gimp.RunMode.INTERACTIVE:
            GimpUi.init(_PROCEDURE)
            dialog = GimpUi.ProcedureDialog.new(procedure, config, "Relight Face")
            dialog.fill(None)
            agreed = dialog.run()
            dialog.destroy()
            if not agreed:
                return procedure.new_return_values(Gimp.PDBStatusType.CANCEL, None)
        try:
            with tempfile.TemporaryDirectory() as folder:
                files = Files.within(folder)
                _export(image, files.target)
                Gimp.progress_init("Relighting")
                Gimp.progress_pulse()
                relight(_wanted(config), files)
                _insert(image, files)
        except (RelitError, OSError) as error:
            told = GLib.Error.new_literal(Gimp.PlugIn.error_quark(), str(error), 0)
            return procedure.new_return_values(Gimp.PDBStatusType.EXECUTION_ERROR, told)
        finally:
            Gimp.progress_end()
        Gimp.displays_flush()
        return procedure.new_return_values(Gimp.PDBStatusType.SUCCESS, None)


def _wanted(config):
    """Return what the dialog holds."""
    photo, light = config.get_property("reference"), config.get_property("light")
    return Wanted(
        photo.get_path() if photo else None,
        None if light == FROM_PHOTO else light,
        {slider.name: config.get_property(slider.name) for slider in SLIDERS},
        config.get_property("command") or "",
    )


def _export(image, path):
    """Write what is seen of an image as PNG; the image stays as it is."""
    copy = image.duplicate()
    try:
        seen = copy.merge_visible_layers(Gimp.MergeType.CLIP_TO_IMAGE)
        seen.resize_to_image_size()
        Gimp.file_save(Gimp.RunMode.NONINTERACTIVE, copy, Gio.File.new_for_path(str(path)), None)
    finally:
        copy.delete()


def _insert(image, files):
    """Put the result on top of an image, with its mask, as one step that can be undone."""
    image.undo_group_start()
    try:
        relit = _loaded(image, files.result, "Relit")
        kept = None if Gimp.Selection.is_empty(image) else Gimp.Selection.save(image)
        white = _loaded(image, files.mask, "Changed")
        image.select_item(Gimp.ChannelOps.REPLACE, _as_mask(white))
        relit.add_mask(relit.create_mask(Gimp.AddMaskType.SELECTION))
        image.remove_layer(white)
        if kept is None:
            Gimp.Selection.none(image)
        else:
            image.select_item(Gimp.ChannelOps.REPLACE, kept)
            image.remove_channel(kept)
    finally:
        image.undo_group_end()


def _loaded(image, path, name):
    """Return a file as the top layer of an image."""
    layer = Gimp.file_load_layer(Gimp.RunMode.NONINTERACTIVE, image, Gio.File.new_for_path(str(path)))
    layer.set_name(name)
    image.insert_layer(layer, None, 0)
    return layer


def _as_mask(layer):
    """Return a layer's brightness as a mask of its own, which can be selected."""
    mask = layer.create_mask(Gimp.AddMaskType.COPY)
    layer.add_mask(mask)
    return mask


Gimp.main(Relit.__gtype__, sys.argv)
