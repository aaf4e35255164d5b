"""Processes that are started from a user's script."""

import ast
import sys
from pathlib import Path

from fogsim.errors import InputError


def refuse_to_run_again() -> None:
    """Refuse a script that each process would run from its beginning, as multiprocessing's do, this call included."""
    main, frame = sys.modules["__main__"], sys._getframe()
    while frame.f_back is not None and (frame.f_globals is not vars(main) or frame.f_code.co_name != "<module>"):
        frame = frame.f_back
    try:
        script = ast.parse(Path(str(main.__file__)).read_bytes())
    except (AttributeError, OSError, SyntaxError, ValueError):
        return
    if frame.f_globals is not vars(main):
        return
    here = [one for one in script.body if one.lineno <= frame.f_lineno <= (one.end_lineno or 0)]
    names = {name.id for one in here for name in ast.walk(one) if isinstance(name, ast.Name)}
    if here and "__name__" not in names:
        raise InputError(
            f"{main.__file__}:{frame.f_lineno}: processes that are started here run this script again: put what only "
            'the first is to do below if __name__ == "__main__":'
        )
