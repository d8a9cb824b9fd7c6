# MuJoCo 4 fills its module at import, which no type checker can follow: everything in it is Any.
from typing import Any

def __getattr__(name: str) -> Any: ...
