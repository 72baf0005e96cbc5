"""A sweep on a real Dask cluster: the same lines, whatever happens to its workers, and an end when none is left."""

import contextlib
import importlib.util
import json
import os
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from firmware_protocol.errors import AddressError, ConfigError
from nxtdrive.cli.main import DONE, main
from nxtdrive.tools.sweep import cluster as cluster_module
from nxtdrive.tools.sweep.cluster import Cluster
from nxtdrive.tools.sweep.result_file import read_results
from nxtdrive.tools.sweep.runner import plan, sweep
from nxtdrive.tools.sweep.task import evaluate
from tests.waiting import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("cluster"),
    pytest.mark.skipif(
        importlib.util.find_spec("distributed") is None, reason="needs Dask: pip install 'nxtdrive[cluster]'"
    ),
]

TASKS = plan(["open", "absent"], [101], ["thesis", "oracle"], "geometric")
STARTS_S = 30.0
KILLER = """
import os
from nxtdrive.tools.sweep import agents
agents.AGENTS["thesis"] = lambda robot: os._exit(1)
"""


class DaskCluster:
    """A scheduler and its workers, each a process of its own."""

    def __init__(self, stack, folder, **environment):
        self.stack, self.folder = stack, folder
        file = folder / "scheduler.json"
        ports = ("--port", "0", "--dashboard-address", "127.0.0.1:0")
        self.scheduler = self._start(environment, "scheduler", *ports, "--scheduler-file", str(file))
        self.address = json.loads(until(lambda: file.exists() and file.read_text()))["address"]
        self.workers = []

    def add_workers(self, number, *words, **environment):
        alone = ("--nthreads", "1", "--no-nanny", "--local-directory", str(self.folder))
        added = [self._start(environment, "worker", self.address, *alone, *words) for _ in range(number)]
        self.workers += added
        return added

    def dismiss_workers(self):
        """End all workers, for the next test."""
        while self.workers:
            self.workers.pop().kill()
        with self.look() as client:
            until(lambda: not client.nthreads())

    def join(self, number, workers_timeout_s=STARTS_S):
        """The cluster as a sweep sees it, once it has this many workers."""
        self.wait_for(number)
        return Cluster(self.address, workers_timeout_s=workers_timeout_s)

    def wait_for(self, number):
        with self.look() as client:
            client.wait_for_workers(number, timeout=STARTS_S)

    def look(self):
        from distributed import Client

        return Client(self.address, set_as_default=False)

    def _start(self, environment, *words):
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--host", "127.0.0.1", "--no-dashboard"],
            cwd=self.folder,
            env=os.environ | environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.stack.callback(process.wait)
        self.stack.callback(process.kill)
        return process


def _older(folder):
    """A folder whose nxtdrive claims an older version."""
    metadata = folder / "older" / "nxtdrive-0.0.9.dist-info" / "METADATA"
    metadata.parent.mkdir(parents=True)
    metadata.write_text("Metadata-Version: 2.1\nName: nxtdrive\nVersion: 0.0.9\n", encoding="utf-8")
    return str(metadata.parents[1])


@pytest.fixture(scope="module", name="results")
def _results():
    return [evaluate(task) for task in TASKS]


@pytest.fixture(scope="module", name="shared")
def _shared(tmp_path_factory):
    with contextlib.ExitStack() as stack:
        yield DaskCluster(stack, tmp_path_factory.mktemp("dask"))


@pytest.fixture
def dask(shared):
    """A scheduler that outlives the test, without workers."""
    yield shared
    shared.dismiss_workers()


@pytest.fixture
def impatient_dask(tmp_path):
    """A mission that kills one worker is not given to three more."""
    with contextlib.ExitStack() as stack:
        yield DaskCluster(stack, tmp_path, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")


def test_the_file_is_that_of_one_process_also_after_an_interruption(dask, results, tmp_path, capsys):
    out = tmp_path / "out.jsonl"
    out.write_text(results[0].to_json() + "\n", encoding="utf-8")
    dask.add_workers(2)
    dask.wait_for(2)
    words = ["--classes", "open,absent", "--seeds", "101", "--policies", "thesis,oracle", "--out", str(out)]
    assert main(["sweep", *words, "--resume", "--dask", dask.address]) == DONE
    assert out.read_text(encoding="utf-8") == "".join(result.to_json() + "\n" for result in results)
    assert "4/4" in capsys.readouterr().err


@pytest.mark.nightly
def test_the_missions_of_a_worker_that_dies_are_done_by_another(dask, results, tmp_path):
    first, _ = dask.add_workers(2)
    dead = []

    def kill(_):
        if not dead:
            dead.append(first.kill())

    with dask.join(2) as cluster:
        assert sweep(TASKS, tmp_path / "x", cluster.workers, progress=kill).results == results


@pytest.mark.nightly
def test_a_mission_that_kills_its_workers_is_a_line_and_the_others_are_done(impatient_dask, results, tmp_path):
    (tmp_path / "killer.py").write_text(KILLER, encoding="utf-8")
    impatient_dask.add_workers(3, "--preload", "killer.py")
    with impatient_dask.join(3) as cluster:
        found = sweep(TASKS[:2], tmp_path / "out.jsonl", cluster.workers).results
    assert found[1] == results[1]
    assert found[0].broke
    assert found[0].error == "WorkersDied: 1 workers died over it, one after the other"


@pytest.mark.nightly
def test_without_a_worker_the_sweep_ends(dask, tmp_path):
    with pytest.raises(ConfigError, match=r"has had no worker for 0 s\. Start some: dask worker tcp://"):
        Cluster(dask.address, workers_timeout_s=0.1)
    (worker,) = dask.add_workers(1)
    with dask.join(1, workers_timeout_s=0.1) as cluster, pytest.raises(ConfigError, match="has had no worker"):
        sweep(TASKS * 2, tmp_path / "x", cluster.workers, progress=lambda _: worker.kill())
    assert 0 < len(read_results(tmp_path / "x")) < len(TASKS)


@pytest.mark.nightly
def test_a_scheduler_that_goes_away_ends_the_sweep(tmp_path):
    with contextlib.ExitStack() as stack:
        dask = DaskCluster(stack, tmp_path)
        dask.add_workers(1)
        with dask.join(1) as cluster, pytest.raises(ConfigError, match=r"failed \(.*--resume"):
            sweep(TASKS * 2, tmp_path / "x", cluster.workers, progress=lambda _: dask.scheduler.kill())


@pytest.mark.nightly
def test_ctrl_c_cancels_what_is_outstanding(dask, tmp_path):
    dask.add_workers(1)

    def interrupt(_):
        raise KeyboardInterrupt

    with dask.join(1) as cluster, dask.look() as client:
        with pytest.raises(KeyboardInterrupt):
            sweep(TASKS * 2, tmp_path / "x", cluster.workers, progress=interrupt)
        assert until(lambda: not any(client.processing().values()))
    assert len(read_results(tmp_path / "x")) == 1


def test_workers_with_another_version_are_named(dask, tmp_path, refused):
    another = tmp_path / "another" / "nxtdrive.py"
    another.parent.mkdir()
    another.write_text("", encoding="utf-8")
    dask.add_workers(1)
    dask.add_workers(1, PYTHONPATH=_older(tmp_path))
    dask.add_workers(1, PYTHONPATH=str(another.parent))
    dask.wait_for(3)
    said = refused("sweep", "--out", tmp_path / "x", "--dask", dask.address)
    assert "not every worker has the nxtdrive of this computer" in said
    assert "has 0.0.9" in said
    assert "has none of this kind (ModuleNotFoundError" in said
    assert said.count("tcp://127.0.0.1:") == 2


@pytest.mark.nightly
def test_a_worker_with_another_version_that_joins_later_ends_the_sweep(dask, tmp_path):
    (worker,) = dask.add_workers(1)
    with dask.join(1) as cluster:
        dask.add_workers(1, PYTHONPATH=_older(tmp_path))
        dask.wait_for(2)
        worker.kill()
        with dask.look() as client:
            until(lambda: len(client.nthreads()) == 1)
        with pytest.raises(ConfigError, match=r"not every worker .* has 0\.0\.9\. Install the same there"):
            sweep(TASKS[:1], tmp_path / "x", cluster.workers)
    assert read_results(tmp_path / "x") == []


@pytest.mark.parametrize("address", ["tcp://host", "here", "usb://1:2", "tcp://127.0.0.1:70000"])
def test_an_invalid_address_is_refused(address):
    with pytest.raises(AddressError, match="tcp://host:8786"):
        Cluster(address)


def test_a_missing_or_silent_scheduler_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(cluster_module, "CONNECT_S", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(ConfigError, match="no Dask scheduler answers"):
            Cluster(address)
    with pytest.raises(ConfigError, match="Start one there"):
        Cluster(address)


@pytest.mark.parametrize("greeting", [b"", b"ok", b"SSH-2.0-OpenSSH_9.6\r\n"])
def test_another_program_is_not_taken_for_a_scheduler(greeting):
    with socket.create_server(("127.0.0.1", 0)) as server, ThreadPoolExecutor(1) as pool:

        def greet():
            with server.accept()[0] as connection:
                connection.sendall(greeting)

        greeted = pool.submit(greet)
        with pytest.raises(ConfigError, match="another program does"):
            Cluster(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        greeted.result()
