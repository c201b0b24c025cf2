"""Views of recordings and states, as pages and pictures, in notebooks and files."""

from __future__ import annotations

import base64
import tempfile
import warnings
import webbrowser
from html import escape
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from ._pliant import Simulation, _live, _page, _picture


class View:
    """View of a recording: the page of ``pliant view``, and a picture as a fallback.

    A notebook shows it as the last expression of a cell: the page in a frame without network, cookies or
    server, or the picture where pages are not shown (GitHub, untrusted notebooks).

    Attributes
    ----------
    html : str
        HTML page.
    png : bytes
        PNG picture.
    frames, frame_count : int
        Numbers of frames in the page and in the recording.
    left_out : list of str
        Colourings that did not fit into the page.
    height : int
        Height in a notebook [pixel].
    """

    def __init__(self, path: str | PathLike[str], max_bytes: int = 2_000_000, height: int = 480) -> None:
        for name, number in (("max_bytes", max_bytes), ("height", height)):
            if number < 1:
                raise ValueError(f"`{name}` must be 1 or more, got {number}")
        self.html, self.frames, self.frame_count, self.left_out = _page(fspath(path), max_bytes)
        self.png = _picture(fspath(path))
        self.height = height

    def __repr__(self) -> str:
        return f"<pliant.View of {self.frames} of {self.frame_count} frames, {len(self.html)} bytes>"

    def _repr_html_(self) -> str:
        # An attribute of a frame without an origin: nothing in the page reaches the notebook.
        return (
            f'<iframe srcdoc="{escape(self.html)}" sandbox="allow-scripts" '
            f'style="width: 100%; height: {self.height}px; border: 0" title="pliant"></iframe>'
        )

    def _repr_png_(self) -> bytes:
        return self.png

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        return {
            "text/plain": repr(self),
            "text/html": self._repr_html_(),
            "image/png": base64.b64encode(self.png).decode(),
        }

    def save(self, to: str | PathLike[str], *, overwrite: bool = False) -> Path:
        """Write the page (``.html``) or the picture (``.png``).

        Parameters
        ----------
        to : str or os.PathLike
            File to write; its ending decides.
        overwrite : bool, default False
            True to replace an existing file.

        Returns
        -------
        pathlib.Path
            The file.

        Raises
        ------
        FileExistsError
            The file exists.
        ValueError
            The ending is neither ``.html`` nor ``.png``.

        Examples
        --------
        >>> trajectory.view().save("beam.html").name
        'beam.html'
        """
        path = Path(to)
        content = {".html": self.html.encode(), ".png": self.png}.get(path.suffix.lower())
        if content is None:
            raise ValueError(f"{path} ends in neither .html nor .png")
        with path.open("wb" if overwrite else "xb") as file:
            file.write(content)
        return path

    def open(self) -> Path:
        """Show the page in the browser, from a temporary file that is kept.

        Returns
        -------
        pathlib.Path
            The file.

        Examples
        --------
        >>> trajectory.view().open().suffix
        '.html'
        """
        with tempfile.NamedTemporaryFile(suffix=".html", prefix="pliant-", delete=False) as file:
            file.write(self.html.encode())
        webbrowser.open(Path(file.name).as_uri())
        return Path(file.name)


class LiveView:
    """Copy of a simulation that runs live in a page, as in ``pliant live``.

    A thread of this process serves the page on loopback, at a random port and a secret address; other
    machines, and frames from other machines, are refused. A notebook shows it as the last expression of a
    cell.

    Attributes
    ----------
    url : str
        Address of the page.
    is_running : bool
        True while the page is served.
    height : int
        Height in a notebook [pixel].
    """

    def __init__(self, simulation: Simulation, height: int = 480) -> None:
        if height < 1:
            raise ValueError(f"`height` must be 1 or more, got {height}")
        self.height = height
        self._run = _live(simulation)

    @property
    def url(self) -> str:
        """str: Address of the page."""
        return self._run.url

    @property
    def is_running(self) -> bool:
        """bool: True while the page is served."""
        return self._run.is_running

    def __repr__(self) -> str:
        return f"<pliant.LiveView at {self.url}>" if self.is_running else "<pliant.LiveView, stopped>"

    def _repr_html_(self) -> str:
        # Another origin than the notebook: nothing in the page reaches it.
        return (
            f'<iframe src="{escape(self.url)}" style="width: 100%; height: {self.height}px; border: 0" '
            'title="pliant"></iframe>'
        )

    def open(self) -> str:
        """Show the page in the browser.

        Returns
        -------
        str
            Address of the page.

        Examples
        --------
        >>> with simulation.view(live=True) as live:
        ...     live.open() == live.url
        True
        """
        webbrowser.open(self.url)
        return self.url

    def stop(self) -> Simulation:
        """Stop serving the page.

        Returns
        -------
        Simulation
            Simulation in its last state, with the parameters set in the page; pins that were turned off are
            on again.

        Raises
        ------
        RuntimeError
            The page has been stopped before.

        Examples
        --------
        >>> live = simulation.view(live=True)
        >>> live.stop().vertex_count
        10
        """
        return self._run.stop()

    def __enter__(self) -> LiveView:
        return self

    def __exit__(self, *_: object) -> None:
        if self.is_running:
            self.stop()


def _of_state(simulation: Simulation, max_bytes: int, height: int) -> View:
    """Return a view of the current state, from a temporary recording of one frame."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        # They are said by runs; no step is taken here.
        warnings.simplefilter("ignore", RuntimeWarning)
        path = Path(folder, "state.mcap")
        simulation.run(simulation.time, record=path)
        return View(path, max_bytes, height)
