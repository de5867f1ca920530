"""One kind of error for everything a user can get wrong."""

from __future__ import annotations


def printable(text: str) -> str:
    """A text that quotes a file, whatever is in it: escaped, if it could not be printed."""
    return text if text.isprintable() else text.encode("unicode_escape").decode("ascii")


class InputError(ValueError):
    """A value that is not accepted: what it is called, what it was, and what is accepted.

    Parameters
    ----------
    argument : str
        Name of the argument, in the user's words ("camera fov", "quadLight ab").
    value : object
        The offending value, shown with ``repr`` and cut at 60 characters; of a path the end is.
    accepted : str
        What would have been accepted, as a noun phrase ("an angle in (0, 180) degrees").
    where : str
        Where it came from, for example "scene.test:12"; empty when unknown.
    """

    def __init__(self, argument: str, value: object, accepted: str, where: str = "") -> None:
        self.argument, self.value, self.accepted, self.where = argument, value, accepted, where
        shown = value if isinstance(value, str) else repr(value)
        if len(shown) > 60:
            is_path = "/" in shown and " " not in shown
            shown = "..." + shown[-57:] if is_path else shown[:57] + "..."
        shown = shown.encode("unicode_escape").decode("ascii")
        super().__init__(f"{where + ': ' if where else ''}{printable(argument)} = {shown}: expected {accepted}")

    def at(self, where: str) -> InputError:
        """The same error with the place it came from (``file:line``)."""
        return InputError(self.argument, self.value, self.accepted, where)

    def __reduce__(self) -> tuple[type, tuple[str, object, str, str]]:
        # Errors cross process boundaries; the default would call __init__ with the message alone.
        return InputError, (self.argument, repr(self.value), self.accepted, self.where)


class WorkerLost(RuntimeError):
    """Work that kills the processes it is given to."""
