"""Files of animations: GIF always, MP4 where ffmpeg is installed."""

import io
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Self

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from cgla_graph._files import write_files
from cgla_graph.errors import OutputError
from cgla_graph.plots.animation import DPI, MOST_FRAMES, Film, frame_ticks
from cgla_graph.plots.flight import LabelledFlight
from cgla_graph.plots.page import style
from cgla_graph.plots.scene import NEAR_COLOUR, TIMED_COLOUR, own_colour

#: Seconds that all frames but the last take together, and that the last one stays.
SECONDS, LAST_SECONDS = 8.0, 2.0
#: Dots per inch, frames at most and colours: the usual ones, and small ones.
_USUAL, _SMALL = (DPI, MOST_FRAMES, 255), (82, 46, 80)
_WHITE = 253  # of 255: from here on in red, green and blue, a dot is white
_SAMPLES = 6  # frames that the palette is made of
_MOST_OWN = 40  # UAVs whose colours are exact
_SHADE = 5  # colours that differ by at most this in red, green and blue count as one


def suffixes() -> list[str]:
    """
    List the formats that can be written here: GIF always, MP4 where ffmpeg is installed.

    Examples
    --------
    >>> suffixes()[0]
    '.gif'
    """
    return [".gif", ".mp4"] if shutil.which("ffmpeg") else [".gif"]


def animate(view: LabelledFlight, paths: Sequence[Path], *, small: bool = False) -> list[Path]:
    """
    Write the animation of a flight to files: the same flight gives the same bytes.

    Each file is ``.gif``, or ``.mp4`` where ffmpeg is installed, and is written whole or not at all. A small one, for
    notebooks, is three quarters as wide, with fewer frames and colours.

    Raises
    ------
    OutputError
        If it cannot be drawn or written; nothing is left behind then.
    """
    for path in paths:
        if path.suffix.lower() not in _ENCODERS:
            msg = f"{path}: {path.suffix or 'no suffix'} is not a format of animations; name the file .gif or .mp4"
            raise OutputError(msg)
    try:
        encoded = _encoded(view, [path.suffix.lower() for path in paths], *(_SMALL if small else _USUAL))
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        msg = f"{', '.join(map(str, paths))}: cannot be drawn: {reason}"
        raise OutputError(msg) from error
    write_files(dict(zip(paths, encoded, strict=True)))
    return list(paths)


def _encoded(view: LabelledFlight, kinds: Sequence[str], dpi: int, most: int, n_colours: int) -> list[bytes]:
    """Draw each frame once, for all formats; only one frame is held uncompressed at a time."""
    with style(), ExitStack() as stack:
        film = Film(view, dpi)
        ticks = frame_ticks(view.flight.ticks, most)
        some = [film.frame(ticks[i]) for i in np.unique(np.linspace(0, len(ticks) - 1, _SAMPLES).astype(int))]
        milliseconds = frame_milliseconds(len(ticks))
        own = [own_colour(uav, number) for number, uav in enumerate(view.mission.uavs)]
        encoders: list[_Gif | _Mp4] = []
        for kind in kinds:
            encoders.append(_ENCODERS[kind](some, milliseconds, own, n_colours))
            stack.push(encoders[-1])
        for frame in map(film.frame, ticks):
            for encoder in encoders:
                encoder.add(frame)
        return [encoder.data() for encoder in encoders]


def frame_milliseconds(n_frames: int) -> int:
    """
    Return the time of a frame in milliseconds, a multiple of 10, as GIF requires.

    Examples
    --------
    >>> frame_milliseconds(80), frame_milliseconds(2)
    (100, 200)
    """
    return 10 * min(20, max(4, round(100.0 * SECONDS / n_frames)))


class _Gif:
    """Encodes frames as a GIF that repeats; all share one palette, so that unchanged parts take no space."""

    def __init__(self, some: Sequence[Image.Image], milliseconds: int, own: Sequence[str], n_colours: int) -> None:
        # one more colour marks unchanged dots
        self.palette, self.milliseconds = _palette(some, own, n_colours), milliseconds
        self.images: list[Image.Image] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.images.clear()

    def add(self, frame: Image.Image) -> None:
        """Give each dot its nearest colour; nearly white becomes white, which Pillow may miss."""
        image = frame.quantize(palette=self.palette, dither=Image.Dither.NONE)
        white = np.asarray(frame).min(axis=2) >= _WHITE
        image.paste(0, mask=Image.fromarray(white))
        self.images.append(image)

    def data(self) -> bytes:
        """Return the whole file."""
        durations = [self.milliseconds] * (len(self.images) - 1) + [int(1000 * LAST_SECONDS)]
        file = io.BytesIO()
        first, *others = self.images
        # optimised, unchanged dots become transparent
        first.save(file, "GIF", save_all=True, append_images=others, duration=durations, loop=0, optimize=True)
        return file.getvalue()


def _palette(some: Sequence[Image.Image], own: Sequence[str], n_colours: int) -> Image.Image:
    """Return an image whose palette suits all frames: exact colours of UAVs, and the most frequent others."""
    meant = [
        to_rgb(name)
        for name in ("white", "black", NEAR_COLOUR, TIMED_COLOUR, *dict.fromkeys(own[: min(_MOST_OWN, n_colours // 4)]))
    ]
    # with the shades of thin lines, which mix with the background
    shades = [[round(255 * (1 - share * (1 - part))) for part in colour] for colour in meant for share in (1.0, 0.55)]
    exact = [list(colour) for colour in dict.fromkeys(map(tuple, shades))]
    sheet = Image.new("RGB", (some[0].width, sum(frame.height for frame in some)))
    for row, frame in enumerate(some):
        sheet.paste(frame, (0, row * frame.height))
    used = sheet.quantize(n_colours - len(exact), method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    others = np.reshape(used.getpalette() or [], (-1, 3))
    # a shade next to an exact colour would take dots from it
    apart = np.abs(others[:, None, :] - np.array(exact)).max(axis=2).min(axis=1) > _SHADE
    palette = Image.new("P", (1, 1))
    palette.putpalette([*np.ravel(exact).tolist(), *np.ravel(others[apart]).tolist()])
    return palette


class _Mp4:
    """Encodes frames as a film that every browser plays; a pipe passes them to ffmpeg."""

    def __init__(self, some: Sequence[Image.Image], milliseconds: int, own: Sequence[str], n_colours: int) -> None:
        del own, n_colours  # a film has room for all
        program = shutil.which("ffmpeg")
        if program is None:
            msg = "ffmpeg is not installed; install it, or write a .gif"
            raise OutputError(msg)
        self.folder = tempfile.TemporaryDirectory()
        self.file, self.said = Path(self.folder.name, "film.mp4"), Path(self.folder.name, "said")
        self.n_last = max(1, round(1000 * LAST_SECONDS / milliseconds))
        self.last = some[-1]
        width, height = self.last.size
        raw = ["-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", f"{width}x{height}"]
        rate = ["-framerate", f"1000/{milliseconds}"]
        # even sides, as the format requires; one thread and no encoder names give the same bytes each time
        even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-pix_fmt", "yuv420p"]
        same = ["-threads", "1", "-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact"]
        words = ["-loglevel", "error", *raw, *rate, "-i", "-", "-an", *even, *same, "-movflags", "+faststart"]
        with self.said.open("wb") as said:
            self.process = subprocess.Popen(  # noqa: S603 - the user's own ffmpeg; the arguments are numbers
                [program, *words, "-y", str(self.file)], stdin=subprocess.PIPE, stdout=said, stderr=said
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        # no process and no file is left, on errors too
        if self.process.stdin is not None:
            with suppress(OSError):
                self.process.stdin.close()
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.folder.cleanup()

    def add(self, frame: Image.Image) -> None:
        """Hand over a frame; if ffmpeg has ended, `data` says why."""
        self.last = frame
        if self.process.stdin is not None:
            with suppress(BrokenPipeError):
                self.process.stdin.write(frame.tobytes())

    def data(self) -> bytes:
        """Return the whole file."""
        for _ in range(self.n_last - 1):
            self.add(self.last)
        if self.process.stdin is not None:
            with suppress(BrokenPipeError):
                self.process.stdin.close()
        if self.process.wait():
            msg = f"ffmpeg failed: {self.said.read_text(encoding='utf-8', errors='replace').strip()[:200]}"
            raise OutputError(msg)
        return self.file.read_bytes()


_ENCODERS: Mapping[str, type[_Gif | _Mp4]] = {".gif": _Gif, ".mp4": _Mp4}
