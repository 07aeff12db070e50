"""The command line."""

import os

from relit.runtime.threads import ONE_BLAS_THREAD

# Before NumPy is loaded, so that what is worked out beside `one_blas_thread` has one thread as well. When
# threads could set it back for one another, of 24 runs on one pair of 24 MP, one or two gave other bytes.
for _name, _count in ONE_BLAS_THREAD.items():
    os.environ.setdefault(_name, _count)
