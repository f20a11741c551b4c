"""Kernels that were compiled when an image was built: they are loaded from a folder that nobody may write.

Numba uses a folder for compiled code only if it can write to it. Images set ``NUMBA_CACHE_LOCATOR_CLASSES`` to the
class here, and have a root file system that is read-only. A kernel that is not in the folder cannot be saved: that
fails at once, instead of compiling at each start.
"""

from numba.core.caching import UserProvidedCacheLocator


class BuiltKernels(UserProvidedCacheLocator):
    """The folder ``NUMBA_CACHE_DIR``, as it is."""

    def ensure_cache_path(self) -> None:
        """Leave the folder alone: numba would write to it here, to see if it can."""
