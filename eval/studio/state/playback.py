"""Playback of a clip: the time that is shown, moved on by a clock, whoever draws it."""

from dataclasses import dataclass

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0)


@dataclass
class Playback:
    """Time that is shown of a clip, and how it runs on.

    Attributes:
        start_s: Time of the first frame in the file [s].
        stop_s: Time of the last frame in the file [s].
        fps: Frame rate by which frames are counted [1/s].
        time_s: Time that is shown [s].
        speed: Share of the true speed.
        is_playing: Whether the time runs.
        is_looped: Whether it begins again at the end.
    """

    start_s: float = 0.0
    stop_s: float = 0.0
    fps: float = 60.0
    time_s: float = 0.0
    speed: float = 1.0
    is_playing: bool = False
    is_looped: bool = True

    @property
    def frame(self) -> int:
        """Number of the frame that is shown, from 0."""
        return round((self.time_s - self.start_s) * self.fps)

    @property
    def num_frames(self) -> int:
        """Number of frames."""
        return round((self.stop_s - self.start_s) * self.fps) + 1

    def show(self, start_s: float, num_frames: int, fps: float) -> None:
        """Take another clip, and keep the time where it has that time."""
        self.start_s, self.stop_s, self.fps = start_s, start_s + (num_frames - 1) / fps, fps
        self.seek(self.time_s)

    def seek(self, time_s: float) -> None:
        """Show a time, or the end of the clip that is nearest to it [s]."""
        self.time_s = min(max(time_s, self.start_s), self.stop_s)

    def step(self, frames: int) -> None:
        """Stop, and show the frame that is so many later."""
        self.is_playing = False
        self.seek(self.start_s + (self.frame + frames) / self.fps)

    def play(self, playing: bool) -> None:
        """Let the time run or stand; at the end it begins again."""
        if playing and not self.is_looped and self.time_s >= self.stop_s:
            self.time_s = self.start_s
        self.is_playing = playing

    def advance(self, elapsed_s: float) -> None:
        """Let the time run on by what has passed [s] at the chosen speed."""
        if not self.is_playing:
            return
        later = self.time_s + self.speed * elapsed_s
        length = self.stop_s - self.start_s
        if later > self.stop_s and self.is_looped and length > 0.0:
            later = self.start_s + (later - self.start_s) % length
        elif later >= self.stop_s:
            self.is_playing = False
        self.seek(later)
