"""Which branches of source files were taken, both ways, while something ran.

A branch is a conditional jump of the bytecode, and counts twice: going on, and jumping. So ternaries, ``and``, ``or``
and loops inside an expression count as ``if`` does; what runs at import alone, and which exceptions an ``except`` lets
pass, does not. Code whose branches have all been seen is no longer traced.
"""

from __future__ import annotations

import dis
import inspect
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

Key = tuple[str, int, str, int, bool]
"""File, first line and name of a code object; offset of a jump; whether it went on."""
EXCEPTIONS = ("CHECK_EXC_MATCH", "WITH_EXCEPT_START")
"""What stands before jumps that the compiler makes for exceptions."""


def _codes(code: CodeType, is_inside: bool = False) -> Iterator[CodeType]:
    """Functions, and what stands in them; a module's own comprehensions run at import."""
    for inner in (constant for constant in code.co_consts if isinstance(constant, CodeType)):
        is_function = bool(inner.co_flags & inspect.CO_OPTIMIZED) and (is_inside or not inner.co_name.endswith("comp>"))
        if is_function:
            yield inner
        yield from _codes(inner, is_function)


def _jumps(code: CodeType) -> dict[int, tuple[int, int]]:
    """Place of every conditional jump: the offset of what comes after it, and its line."""
    found, line, start, before = {}, code.co_firstlineno, -1, ""
    for step, after in pairwise(dis.get_instructions(code)):
        line = step.positions.lineno or line if step.positions else line
        start = start if start >= 0 else step.offset  # a long jump begins with its EXTENDED_ARG
        if step.opname == "EXTENDED_ARG":
            continue
        if step.opname.startswith(("POP_JUMP", "JUMP_IF", "FOR_ITER")) and before not in EXCEPTIONS:
            found[start] = after.offset, line
        start, before = -1, step.opname
    return found


class Branches:
    """The branches of some files, and those seen."""

    def __init__(self, files: Iterable[Path]) -> None:
        self.lines: dict[Key, str] = {}
        self._jumps: dict[tuple[str, int, str], dict[int, tuple[int, int]]] = {}
        for file in files:
            path = os.path.realpath(file)
            for code in _codes(compile(Path(path).read_bytes(), path, "exec")):
                place = path, code.co_firstlineno, code.co_name
                self._jumps[place] = _jumps(code)
                for offset, (_, line) in self._jumps[place].items():
                    for went_on in (True, False):
                        self.lines[*place, offset, went_on] = f"{Path(path).name}:{line}"
        self.seen: set[Key] = set()
        self._left: dict[CodeType, set[tuple[int, bool]]] = {}  # branches of code that ran, not yet seen

    def run(self, call: Callable[[], Any]) -> Any:
        """Call it, and see."""
        sys.settrace(self._enter)
        try:
            return call()
        finally:
            sys.settrace(None)

    def _place(self, code: CodeType) -> tuple[str, int, str]:
        return os.path.realpath(code.co_filename), code.co_firstlineno, code.co_name

    def _enter(self, frame: FrameType, event: str, _: Any) -> Any:
        code = frame.f_code
        left = self._left.get(code)
        if left is None:
            jumps = self._jumps.get(self._place(code), {})
            left = self._left[code] = {(offset, went_on) for offset in jumps for went_on in (True, False)}
        if not left:
            return None
        place = self._place(code)
        jumps, last = self._jumps[place], -1
        frame.f_trace_opcodes, frame.f_trace_lines = True, False

        def step(frame: FrameType, event: str, _: Any) -> Any:
            nonlocal last
            if event == "opcode":
                if last in jumps:
                    taken = last, frame.f_lasti == jumps[last][0]
                    left.discard(taken)
                    self.seen.add((*place, *taken))
                last = frame.f_lasti
            return step

        return step

    def missed(self) -> list[str]:
        """File and line of every branch that was not taken both ways."""
        return sorted({line for key, line in self.lines.items() if key not in self.seen})
