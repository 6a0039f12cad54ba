"""Dask clusters: the one module that imports `distributed`, which comes with the extra `cluster`."""

import io
import logging
import pickle
import re
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ogmkit.base.cluster_worker import Terms, releases, stop, work
from ogmkit.base.extras import require_packages
from ogmkit.base.interrupts import interrupts_blocked
from ogmkit.base.news import Waiting, tell
from ogmkit.base.units import Answer, log_level
from ogmkit.errors import OgmkitError, SettingsError

if TYPE_CHECKING:
    from distributed import Client

Item = TypeVar("Item")
Result = TypeVar("Result")

LOCAL = "local"
"""Instead of an address: a cluster of this machine's processes, which ends with the command."""

_ADDRESS = re.compile(r"(tcp|tls)://(\[[0-9a-fA-F:.]+\]|[\w.-]+):\d{1,5}", re.ASCII)
_CONNECT_S = 10
_LEAST_WAITING = 64
"""Units that wait at least: workers may join at any time."""
_UNITS_A_THREAD = 2
_AGAIN = "what was finished is whole: rerun the same command: it resumes"


def require_usable(scheduler: str) -> None:
    """Refuse what can't be a scheduler, and to go on without the extra.

    Raises:
        SettingsError: it is neither `local` nor an address.
        MissingPackageError: `distributed` is absent; says how to install it.
    """
    if scheduler != LOCAL and not _ADDRESS.fullmatch(scheduler):
        raise SettingsError(
            f"scheduler {scheduler!r}: give {LOCAL}, or an address such as tcp://10.0.0.7:8786, "
            "which `dask scheduler` shows as it starts"
        )
    require_packages("cluster", ("distributed",))


def require_reachable(address: str) -> None:
    """Refuse an address where no scheduler answers.

    Raises:
        OgmkitError: none does.
    """
    with _quiet(), _client(address):
        pass


@dataclass(frozen=True)
class Cluster:
    """The workers of a scheduler, for one run: a `Crew`.

    Attributes:
        client: connected to the scheduler.
        executor: the client's.
        name: of the scheduler, in words.
        terms: what a worker must agree with.
    """

    client: "Client"
    executor: Executor
    name: str
    terms: Terms

    def submit(self, function: Callable[[Item], Result], item: Item) -> Future[Answer[Result]]:
        """Hand over a unit; its paths travel absolute, since workers run in folders of their own."""
        self.require_alive()
        future: Future[Answer[Result]] = self.executor.submit(work, self.terms, _packed((function, item)))
        return future

    def limit(self) -> int:
        """Enough for the threads that there are now."""
        return max(_LEAST_WAITING, _UNITS_A_THREAD * self._threads())

    def require_alive(self) -> None:
        """Raise an OgmkitError where the scheduler is gone; it has forgotten the units then."""
        if self.client.status != "running":
            raise OgmkitError(f"lost the connection to the scheduler {self.name}; {_AGAIN}")

    def wait_for_workers(self) -> None:
        """Tell whoever listens where there is none yet."""
        if not self._threads():
            tell(Waiting(f"no worker has joined {self.name} yet; start some: dask worker {self.name}"))

    def stop(self) -> None:
        """Return once no worker does anything of this run any more."""
        if self.client.status == "running":
            with suppress(OSError):
                self.client.run(stop, self.terms.run, on_error="ignore")

    def _threads(self) -> int:
        try:
            return sum(self.client.nthreads().values())
        except OSError:  # a scheduler that has just gone
            return 0


@contextmanager
def workers_of(scheduler: str, workers: int, shared: Sequence[Path]) -> Iterator[Cluster]:
    """The workers of a running scheduler, or of one that ends with the block.

    Args:
        scheduler: its address, or `local`.
        workers: number of processes of a local one.
        shared: files and folders that all workers must see.

    Raises:
        OgmkitError: the scheduler can't be reached, or is lost inside; workers died over a unit again and
            again, or can't import ogmkit.
    """
    from distributed import KilledWorker  # noqa: PLC0415  # of the extra

    terms = Terms(uuid.uuid4().hex, releases(), tuple(path.absolute() for path in shared), log_level())
    with _quiet(), _connected(scheduler, workers) as client:
        crew = Cluster(client, client.get_executor(pure=False), scheduler, terms)
        crew.wait_for_workers()
        try:
            yield crew
        except BaseException as error:
            crew.stop()
            translated = _translated(error, crew, KilledWorker)
            if translated is None:
                raise
            raise translated from error


def _translated(error: BaseException, crew: Cluster, killed: type[Exception]) -> OgmkitError | None:
    """What an error of Dask means; None for others."""
    if isinstance(error, killed):
        return OgmkitError(
            f"workers of {crew.name} died over the same unit of work again and again, perhaps for lack of "
            f"memory; {_AGAIN}"
        )
    if isinstance(error, CancelledError):
        return OgmkitError(f"lost the connection to the scheduler {crew.name}; {_AGAIN}")
    if isinstance(error, ModuleNotFoundError) and (error.name or "").partition(".")[0] == "ogmkit":
        return OgmkitError(
            f"a worker of {crew.name} has no {error.name}: install the same ogmkit on all machines"
        )
    return None


@contextmanager
def _connected(scheduler: str, workers: int) -> Iterator["Client"]:
    if scheduler != LOCAL:
        with _client(scheduler) as client:
            yield client
        return
    from distributed import LocalCluster  # noqa: PLC0415  # of the extra

    resource_tracker.ensure_running()  # else the thread that starts workers would, which lets it see Ctrl-C
    with ExitStack() as stack:
        with interrupts_blocked():
            cluster = LocalCluster(
                n_workers=max(workers, 1),
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",  # None would take the port that others expect theirs at
                scheduler_kwargs={"dashboard": False},
                memory_limit=None,
                silence_logs=logging.CRITICAL,
            )
            stack.enter_context(cluster)
            client = stack.enter_context(_client(cluster))
        yield client


@contextmanager
def _client(cluster: Any) -> Iterator["Client"]:  # noqa: ANN401  # an address or a cluster
    from distributed import Client  # noqa: PLC0415  # of the extra

    try:
        client = Client(cluster, timeout=_CONNECT_S, set_as_default=False)
    except OSError as error:
        raise OgmkitError(
            f"no Dask scheduler answers at {cluster}; start one with `dask scheduler`"
        ) from error
    with client:
        yield client


@contextmanager
def _quiet() -> Iterator[None]:
    """What becomes of the connection is told by our errors; Dask's own lines would stand beside them."""
    from distributed.utils import silence_logging_cmgr  # noqa: PLC0415  # of the extra

    with silence_logging_cmgr(logging.CRITICAL):
        yield


class _Pickler(pickle.Pickler):
    """Makes relative paths absolute."""

    def reducer_override(self, value: object) -> Any:  # noqa: ANN401  # what pickle takes
        if isinstance(value, Path) and not value.is_absolute():
            return type(value), (str(value.absolute()),)
        return NotImplemented


def _packed(value: object) -> bytes:
    stream = io.BytesIO()
    _Pickler(stream, pickle.HIGHEST_PROTOCOL).dump(value)
    return stream.getvalue()
