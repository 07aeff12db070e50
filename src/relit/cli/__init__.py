"""The command line."""

import os

from relit.runtime.threads import ONE_BLAS_THREAD

# Before NumPy is loaded. Later, `one_blas_thread` can be crossed by another thread that sets the number back:
# of 24 runs on one pair of 24 MP, one or two gave other bytes.
for _name, _count in ONE_BLAS_THREAD.items():
    os.environ.setdefault(_name, _count)
