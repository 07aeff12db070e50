"""relit's options as ComfyUI's widgets: names, ranges, defaults and help are those that relit declares."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from relit.settings.methods import WITH_SECOND_REFERENCE
from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from dataclasses import Field

    Widget = tuple[Any, dict[str, Any]]

#: ``light`` has its own widgets, and no node takes a second reference.
_OPTIONS = {option.name: option for option in fields(TransferOptions) if option.name != "light"}


def widgets(*, expert: bool) -> dict[str, Widget]:
    """Return the widgets of the options for everybody, or of those for experts."""
    return {
        name: _widget(option, {"advanced": True} if expert else {})
        for name, option in _OPTIONS.items()
        if (option.metadata["group"] == "expert") is expert
    }


def options_of(values: dict[str, Any]) -> dict[str, Any]:
    """Return changes of `TransferOptions` from what widgets hold; what is no option of these is left out."""
    return {name: _value(_OPTIONS[name], value) for name, value in values.items() if name in _OPTIONS}


def _widget(option: Field[Any], extra: dict[str, Any]) -> Widget:
    """Return the widget of an option: a list, a switch, a number, or else text."""
    declared, default = option.metadata, option.default
    about = {"tooltip": f"{declared['title']}. {declared['help']}", **extra}
    if choices := declared["choices"]:
        texts = [str(choice) for choice in choices if choice not in WITH_SECOND_REFERENCE]
        return texts, {"default": str(default), **about}
    if isinstance(default, bool):
        return "BOOLEAN", {"default": default, **about}
    low, high = declared["at_least"], declared["at_most"]
    if isinstance(default, float) and not declared["words"] and low is not None and high is not None:
        step = 1.0 if high > 10 else 0.01  # degrees, or shares
        return "FLOAT", {"default": default, "min": float(low), "max": float(high), "step": step, **about}
    return "STRING", {"default": "" if default is None else str(default), **about}


def _value(option: Field[Any], value: Any) -> Any:
    """Return what a widget's value is to `TransferOptions`: of text, the choice or the number it tells."""
    if not isinstance(value, str):
        return value
    if not value.strip():
        return option.default
    for choice in option.metadata["choices"]:
        if str(choice) == value:
            return choice
    if option.metadata["text"]:
        return value.strip()
    try:
        return float(value)
    except ValueError:
        return value.strip()  # a word, or what relit says is none
