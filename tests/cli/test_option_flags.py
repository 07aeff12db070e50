"""The flags of every command, held to the one declaration of options."""

import dataclasses
import shlex

import click
import pytest

from relit import relighting
from relit.cli import app as module
from relit.photo.color import COLOR_SPACES
from relit.settings.options import TransferOptions
from relit.studio.limits import Limits
from tests.command import TRANSFER

FIELDS = {field.name: field for field in dataclasses.fields(TransferOptions)}

# What a command takes besides transfer options.
LOUDNESS = {"quiet", "verbose"}
PHOTOS = {"target", "reference", "target_landmarks", "target_face", "reference_landmarks", "reference_face"}
OTHERS = {
    "transfer": PHOTOS - {"reference"}
    | {
        "references",
        "second_reference",
        "second_landmarks",
        "second_face",
        "region_mask",
        "all_faces",
        "config",
    }
    | {"output", "swap", "stages", "sheet", "changed", "timings", "force", "as_json", "help_all"}
    | LOUDNESS,
    "video": {
        "clip",
        "references",
        "output",
        "face",
        "reference_landmarks",
        "reference_face",
        "first",
        "last",
    }
    | {"reference_end", "codec", "crf", "sheet", "force", "as_json", "help_all"}
    | LOUDNESS,
    "align": PHOTOS | {"output", "force", "as_json"} | LOUDNESS,
    "batch": {"manifest", "kind", "output", "targets", "references", "pairing", "seed", "suffix", "engine"}
    | {"workers", "address", "limit", "dry_run", "results", "journal", "cache_size", "force", "as_json"}
    | {"help_all"}
    | LOUDNESS,
    "decompose": {"image", "output", "landmarks", "face", "eye_distance", "force", "as_json"} | LOUDNESS,
    "normalize": {"image", "output", "landmarks", "face", "eye_distance", "force", "as_json"} | LOUDNESS,
    "evaluate": {"source", "protocol", "chosen", "lams", "jobs", "limit", "output", "figure", "number"}
    | {"force", "as_json"}
    | LOUDNESS,
    "landmarks": {"image", "output", "overlay", "face", "force", "as_json"} | LOUDNESS,
    "samples": {"folder", "force", "as_json"} | LOUDNESS,
    "studio": {"photos", "port", "opened"},
    "serve": {"host", "port", "names", "page", "access_log", "token", "tokenless", "proxies"}
    | {field.name for field in dataclasses.fields(Limits)},
}

OPTIONS = {
    "transfer": set(FIELDS),
    "batch": set(FIELDS),
    "video": set(FIELDS) - {"mask", "full_resolution"},
    "align": {"kernel", "affine", "smoothing"},
    "decompose": {"lam", "neighborhood"},
    "normalize": {"lam", "neighborhood"},
    "evaluate": {"method", "exposure", "tint", "neighborhood", "split_first", "mask"}
    | {"kernel", "affine", "smoothing"},
}


def heeding(name):
    """Return the method beside which an option does something, if that is not the default one."""
    return {"method": "ltv"} if name in ("neighborhood", "split_first") else {}


def flags_of(options):
    return [word for name, value in options.items() for word in (FIELDS[name].metadata["flag"], value)]


class TestOneSourceOfOptions:
    """Flags, defaults, choices and help of the command line are those of `TransferOptions`."""

    @staticmethod
    def parameters(command):
        return {parameter.name: parameter for parameter in module.relit.commands[command].params}

    def test_commands(self):
        assert set(module.relit.commands) == set(OTHERS)

    @pytest.mark.parametrize("command", OTHERS)
    def test_there_are_no_other_parameters(self, command):
        assert set(self.parameters(command)) == OPTIONS.get(command, set()) | OTHERS[command]

    @pytest.mark.parametrize(
        ("command", "name"), [(c, n) for c, names in OPTIONS.items() for n in sorted(names)]
    )
    def test_each_option(self, command, name):
        parameter, field = self.parameters(command)[name], FIELDS[name]
        flag = {"lam": "--lambda"}.get(name, f"--{name.replace('_', '-')}")
        assert parameter.opts == [flag] == [field.metadata["flag"]]
        assert parameter.help == field.metadata["help"]
        assert not parameter.required
        if isinstance(field.default, bool):
            assert parameter.secondary_opts == [flag.replace("--", "--no-")]
        if field.metadata["choices"]:
            assert isinstance(parameter.type, click.Choice)
            assert list(parameter.type.choices) == [str(choice) for choice in field.metadata["choices"]]

    @pytest.fixture
    def options_of(self, run, monkeypatch):
        """Return the options with which the library would be called."""
        received = []

        def stop(*_arguments, options, **_others):
            received.append(options)
            raise KeyboardInterrupt

        monkeypatch.setattr(relighting, "transfer", stop)

        def of(*flags):
            assert run(*shlex.split(TRANSFER), "-o", "out.png", *flags).code == 130
            return received.pop()

        return of

    def test_defaults(self, options_of):
        assert options_of() == TransferOptions()

    @pytest.mark.parametrize(
        ("name", "choice"),
        [(name, choice) for name, field in FIELDS.items() for choice in field.metadata["choices"]],
    )
    def test_every_choice_arrives(self, options_of, name, choice):
        beside = heeding(name)
        options = options_of(*flags_of(beside), FIELDS[name].metadata["flag"], str(choice))
        assert options == TransferOptions(**beside, **{name: choice})
        assert type(getattr(options, name)) is type(choice)

    @pytest.mark.parametrize(
        ("space", "channel"),
        [
            (name, channel)
            for name, space in COLOR_SPACES.items()
            for channel in ("all", *space.channels, *(["primary"] if space.primary else []))
        ],
    )
    def test_every_channel_arrives(self, options_of, space, channel):
        options = options_of("--method", "ltv", "--color-space", space, "--channels", channel)
        assert options == TransferOptions(method="ltv", color_space=space, channels=channel)

    @pytest.mark.parametrize(
        "name", [name for name, field in FIELDS.items() if isinstance(field.default, bool)]
    )
    @pytest.mark.parametrize("value", [True, False])
    def test_every_switch_arrives(self, options_of, name, value):
        beside, flag = heeding(name), f"--{'' if value else 'no-'}{name.replace('_', '-')}"
        assert options_of(*flags_of(beside), flag) == TransferOptions(**beside, **{name: value})

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("lam", 1e-3),
            ("lam", 7.25),
            ("smoothing", 0.0),
            ("exposure", 0.25),
            ("tint", 1.0),
            ("strength", 0.5),
            ("shadows", 0.0),
            ("highlights", 1.5),
            ("fill", 0.4),
            ("tilt", -12.5),
        ],
    )
    def test_numbers_arrive(self, options_of, name, value):
        assert options_of(FIELDS[name].metadata["flag"], repr(value)) == TransferOptions(**{name: value})

    def test_every_field_is_tried_above(self):
        tried = {"channels", "exposure", "lam", "smoothing", "tint", "strength", "shadows", "highlights"}
        tried |= {"softness", "turn", "fill", "tilt"}
        tried |= {"light", "region"}  # in TestControl
        for name, field in FIELDS.items():
            assert field.metadata["choices"] or isinstance(field.default, bool) or name in tried

    @pytest.mark.parametrize("command", OTHERS)
    def test_help(self, succeed, command):
        brief = "".join(succeed(f"{command} --help").decode().split())
        assert brief == "".join(succeed(f"{command} -h").decode().split())
        grouped = "help_all" in OTHERS[command]
        shown = "".join(succeed(f"{command} --help-all").decode().split()) if grouped else brief
        for name in OPTIONS.get(command, set()):
            field = FIELDS[name]
            assert "".join(field.metadata["help"].split()) in shown
            assert field.metadata["flag"] in shown
            assert "|".join(map(str, field.metadata["choices"])) in shown
            if not (field.default is None or isinstance(field.default, bool)):
                assert f"[default:{field.default}]" in shown
        for parameter in self.parameters(command).values():
            if isinstance(parameter, click.Option):
                assert parameter.help
                assert parameter.opts[-1] in shown
                assert parameter.opts[-1] in brief

    def test_overview(self, succeed, run):
        shown = succeed("--help").decode()
        assert all(f"\n  {command} " in shown for command in OTHERS)
        assert run().code == 2

    def test_version(self, succeed):
        from relit import __version__

        assert succeed("--version").decode().split()[-1] == __version__
