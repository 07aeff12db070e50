"""What an argument may be: files, numbers, shares, words; each completes itself in a shell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from relit.settings.option_fields import as_number

if TYPE_CHECKING:
    _Text = click.ParamType[str]
    _Whole = click.ParamType[int]
    _NumberOrWord = click.ParamType[float | str]
    _Seconds = click.ParamType[float]
else:  # before click 8.4, it takes no parameter
    _Text = _Whole = _NumberOrWord = _Seconds = click.ParamType


class Place(_Text):
    """The name of a file or folder, which whoever opens it checks; the shell completes it."""

    def __init__(self, name: str) -> None:
        self.name = name

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Leave it to the shell."""
        del ctx, param
        return [CompletionItem(incomplete, type=self.name)]


FILE, FOLDER = Place("file"), Place("dir")


class Count(_Whole):
    """A whole number, of `least` or more, and at most of `most`."""

    name = "number"

    def __init__(self, least: int, most: int | None = None) -> None:
        self.least, self.most = least, most

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number."""
        try:
            number = int(value)
        except ValueError:
            number = self.least - 1
        if number < self.least or (self.most is not None and number > self.most):
            most = "or more" if self.most is None else f"to {self.most}"
            self.fail(f"{value!r} is not a whole number of {self.least} {most}.", param, ctx)
        return number


class Amount(_Whole):
    """A whole number of 1 or more, of which k, M and G are thousands, millions and milliards: 1.5G."""

    name = "amount"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number."""
        text = str(value)
        factor = {"k": 10**3, "M": 10**6, "G": 10**9}.get(text[-1:], 1)
        try:
            number = float(text[:-1] if factor > 1 else text) * factor
            whole = round(number)
        except (ValueError, OverflowError):
            whole = number = 0
        if whole < 1 or whole != number:
            self.fail(f"{text!r} is not a whole number of 1 or more, as 500k, 200M or 1.5G.", param, ctx)
        return whole


class Duration(_Seconds):
    """A number of seconds above 0."""

    name = "seconds"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the seconds."""
        try:
            seconds = float(value)
        except ValueError:
            seconds = 0.0
        if not 0 < seconds < float("inf"):  # which nan is not either
            self.fail(f"{value!r} is not a number of seconds above 0.", param, ctx)
        return seconds


class Moment(_Seconds):
    """A time in a video: seconds, or minutes and seconds, or hours too: 62.5, 1:02.5, 0:01:02.5."""

    name = "time"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the seconds."""
        seconds = 0.0
        parts = str(value).split(":")
        try:
            for place, part in enumerate(parts):
                number = float(part) if place == len(parts) - 1 else int(part)
                if not 0 <= number < (60 if place else float("inf")) or len(parts) > 3:
                    raise ValueError
                seconds = 60 * seconds + number
        except (ValueError, OverflowError):
            self.fail(f"{value!r} is not a time, as 62.5 (seconds), 1:02.5 or 0:01:02.5.", param, ctx)
        return seconds


class Number(_NumberOrWord):
    """A number, or one of the words that stand for one; of a share, 80% is 0.8.

    `wanted` is what messages say of the numbers and words that it takes.
    """

    name = "number"

    def __init__(self, words: tuple[str, ...] = (), *, share: bool = False, wanted: str = "a number") -> None:
        self.words, self.share, self.wanted = words, share, wanted

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        """Return the number, or the word."""
        if value in self.words:
            return str(value)
        try:
            return as_number(str(value), share=self.share)
        except ValueError:
            share = " (80% is 0.8)" if self.share else ""
            self.fail(f"expected {self.wanted}{share}, got {value!r}", param, ctx)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Complete the words."""
        return Words(self.words).shell_complete(ctx, param, incomplete)


class Words(_Text):
    """Free text in which some words mean something, joined by +."""

    name = "text"

    def __init__(self, words: tuple[str, ...]) -> None:
        self.words = words

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Complete the last of the words."""
        del ctx, param
        before, plus, last = incomplete.rpartition("+")
        return [CompletionItem(before + plus + word) for word in self.words if word.startswith(last)]
