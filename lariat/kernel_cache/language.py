"""Taichi, in which kernels are written; where it has no wheel, Quadrants, its maintained fork."""

from lariat.kernel_cache.source import NoCompilerError

try:
    import taichi as ti
except ModuleNotFoundError:
    try:
        import quadrants as ti  # pyright: ignore[reportMissingImports]  # from Python 3.14 on
    except ModuleNotFoundError as error:
        raise NoCompilerError from error

__all__ = ["ti"]
