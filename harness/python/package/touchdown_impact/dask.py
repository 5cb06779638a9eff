"""A fleet of campaigns diagnosed on a Dask cluster.

>>> from distributed import Client
>>> from touchdown_impact.dask import diagnose
>>> fleet = diagnose(sorted(Path("campaigns").iterdir()), Client("tcp://scheduler:8786"), out="answers")
>>> fleet.lost
>>> fleet.to_frame()

The scheduler gives each worker campaigns as it has time; a worker starts a process of its own for each, so that what ends
that process loses one campaign and no worker. Campaigns and answers lie where client and workers see them under the same
path. What is finished is not done again.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from distributed import Client, as_completed
from distributed.scheduler import KilledWorker
from tqdm import tqdm

from . import _native
from ._native import TouchdownError
from ._task import _SERVE, Fmus
from ._values import read_json

if TYPE_CHECKING:
    import pandas

# The command line in a process of its own: the native module alone, without the package.
_RUN = """
import sys
from importlib.util import module_from_spec, spec_from_file_location
spec = spec_from_file_location("touchdown_impact._native", {path!r})
native = module_from_spec(spec)
spec.loader.exec_module(native)
native.lies_at({path!r}, sys.executable, {serve!r})
sys.exit(native.command(sys.argv[1:], [sys.executable, "-I", "-S", "-c", {itself}]))
"""

# Exit codes of a share: all judged, something lost, something not judged.
_ANSWERED = (0, 2, 3)


@dataclass(frozen=True)
class Fleet:
    """What came of a fleet.

    out: folder of the answers, with index.html, fleet.parquet and fleet.json.
    campaigns, judged: how many there are, and how many of them were judged.
    lost: why, of every campaign that has no answer, by name.
    not_judged: why, of every campaign whose answer says that nothing can be judged.
    growth: every comparison of a mechanism with a column, the surest first, as fleet.json has it.
    """

    out: Path
    campaigns: int
    judged: int
    lost: dict[str, str]
    not_judged: dict[str, str]
    growth: list[dict[str, Any]]

    @property
    def page(self) -> Path:
        """The page of the fleet."""
        return self.out / "index.html"

    def verdict(self, campaign: str) -> dict[str, Any]:
        """What verdict.json of a campaign holds."""
        return read_json(self.out / campaign, "verdict.json")

    def to_frame(self) -> pandas.DataFrame:
        """The table, a row a campaign, what matters first."""
        import pyarrow.parquet

        frame: pandas.DataFrame = pyarrow.parquet.read_table(self.out / "fleet.parquet").to_pandas()
        return frame


def diagnose(
    campaigns: Iterable[str | os.PathLike[str]],
    client: Client,
    out: str | os.PathLike[str],
    *,
    seconds: float | None = None,
    bootstrap: int = 0,
    replicates: int = 1,
    fmus: Fmus = Fmus(),
    command: Sequence[str] | None = None,
    progress: bool = True,
) -> Fleet:
    """Diagnoses campaigns on the workers of a cluster, and puts their answers together.

    campaigns: folders of format recordings/1, or folders of such folders.
    out: folder for the answers; client and workers see it under this path.
    seconds: what a campaign may take; one that is not judged by then is answered as not judged, and a process that does
        not come to an end is killed some time later.
    bootstrap: campaigns simulated and judged for each false-alarm probability, shared by `replicates` tasks.
    fmus: where somebody else's FMUs run.
    command: another program than this package, such as ["touchdown"], on every worker.
    progress: whether to show a bar.

    A worker that dies is no loss: its campaigns go to others. Lost campaigns are named in the fleet, and raise nothing.
    Raises TouchdownError where nothing can be done at all: bad options, a folder that cannot be written.
    """
    if not fmus.in_process and not fmus.fmu_seconds > 0:
        raise TouchdownError(f"Fmus(fmu_seconds={fmus.fmu_seconds}): give a time above 0")
    if replicates < 1 or (replicates > 1 and bootstrap < 1):
        raise TouchdownError("replicates shares the campaigns of bootstrap: give both as 1 or more")
    out = Path(out).absolute()
    folders = _folders(campaigns)
    options = [] if seconds is None else [f"--seconds={float(seconds)!r}"]
    options += ["--in-process"] if fmus.in_process else [f"--fmu-seconds={float(fmus.fmu_seconds)!r}"]
    if fmus.fmu_memory is not None and not fmus.in_process:
        options += ["--fmu-memory", str(int(fmus.fmu_memory))]
    if bootstrap:
        options += ["--bootstrap", str(int(bootstrap))]
    given = list(command) if command is not None else None
    out.mkdir(parents=True, exist_ok=True)
    # beside the answers, where the workers see it, and gone with the call
    with tempfile.NamedTemporaryFile("w", dir=out, prefix=".touchdown-", suffix=".txt", encoding="utf-8") as listed:
        listed.write("".join(f"{f}\n" for f in folders))
        listed.flush()
        always = ["--list", listed.name, "--out", str(out), "--jobs", "1", "--quiet", *options]
        tasks = []
        for i, folder in enumerate(folders):
            for r in range(replicates):
                words = [*always, "--shard", f"{i + 1}/{len(folders)}"]
                if replicates > 1:
                    words += ["--replicates", f"{r + 1}/{replicates}"]
                key = f"touchdown-{folder.name}-{r + 1}-{os.urandom(4).hex()}"
                tasks.append(client.submit(_share, given, words, key=key, pure=False))
        try:
            _wait(tasks, progress)
        except BaseException:
            client.cancel(tasks)
            raise
    return merge(out, command=command)


def merge(out: str | os.PathLike[str], *, command: Sequence[str] | None = None) -> Fleet:
    """Puts the answers in a folder together, as `touchdown merge` does."""
    out = Path(out).absolute()
    done = subprocess.run([*_command(command), "merge", str(out), "--json"], capture_output=True, text=True, check=False)
    if done.returncode not in _ANSWERED or not done.stdout:
        raise TouchdownError(_said(done.stderr))
    found = json.loads(done.stdout)
    why = {kind: {c["campaign"]: c["why"] for c in found[kind]} for kind in ("lost", "not_judged")}
    return Fleet(out, found["campaigns"], found["judged"], why["lost"], why["not_judged"], found["growth"]["all"])


def _folders(campaigns: Iterable[str | os.PathLike[str]]) -> list[Path]:
    """One folder a campaign, by name: as many as the command will count."""
    if isinstance(campaigns, (str, os.PathLike)):
        campaigns = [campaigns]
    found: dict[Path, None] = {}
    for given in map(Path, campaigns):
        below = []
        if given.is_dir() and not (given / "campaign.toml").exists():
            below = [f for f in given.iterdir() if (f / "campaign.toml").is_file()]
        for folder in below or [given]:
            found[folder.resolve()] = None
    if not found:
        raise TouchdownError("no campaign is given")
    for folder in found:
        # they cross to the workers as lines of a text
        text = str(folder)
        if text != text.strip() or not text.isprintable():
            raise TouchdownError(f"{text!r}: its path begins or ends with a blank, or is no plain text; rename it")
    return sorted(found, key=lambda f: f.name)


def _command(given: Sequence[str] | None) -> list[str]:
    """The program's first words."""
    if given is not None:
        return list(given)
    path = str(_native.__file__)
    # the words by which it starts itself are those it was started by
    serve = ["-I", "-S", "-c", _SERVE.format(path=path)]
    text = _RUN.replace("{itself}", "sys.orig_argv[4]").format(path=path, serve=serve)
    return [sys.executable, "-I", "-S", "-c", text]


def _share(command: Sequence[str] | None, words: list[str]) -> None:
    """Runs on a worker: one share. What became of its campaign is written beside the answers."""
    # the process ends with this worker
    environment = dict(os.environ, TOUCHDOWN_SHARE=str(os.getpid()))
    call = [*_command(command), "diagnose", *words]
    done = subprocess.run(
        call, stdin=subprocess.DEVNULL, capture_output=True, text=True, env=environment, check=False
    )
    # codes of a command that was not understood are those of a campaign that is lost: distinguish them by what was said
    if done.returncode not in _ANSWERED or (done.returncode == 2 and not done.stdout):
        raise TouchdownError(_said(done.stderr) or f"the process of a share ended with code {done.returncode}")


def _said(errors: str) -> str:
    return "\n".join(line.removeprefix("error: ") for line in errors.splitlines()) or "the command said nothing"


def _wait(tasks: list[Any], progress: bool) -> None:
    """Waits for all tasks.

    A worker's death and what a share could not do is one campaign's loss; where no share could do anything, that is raised.
    """
    troubles: list[BaseException] = []
    with tqdm(total=len(tasks), desc="diagnose", disable=not progress) as bar:
        for task in as_completed(tasks):
            trouble = task.exception()
            if trouble is not None:
                troubles.append(trouble)
            bar.update()
    if len(troubles) == len(tasks) and not all(isinstance(t, KilledWorker) for t in troubles):
        raise TouchdownError(str(troubles[0]))
