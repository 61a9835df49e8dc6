"""A Dask cluster of two processes on this machine."""

import contextlib
import warnings


@contextlib.contextmanager
def dask_cluster():
    """Yield the address of its scheduler."""
    import distributed  # pyright: ignore[reportMissingImports]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Dask's own, of its imports and at its shutdown
        with distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            worker_dashboard_address=None,
        ) as cluster:
            yield cluster.scheduler_address  # pyright: ignore[reportAttributeAccessIssue]
