"""What is drawn of a clip in each frame: the figures before and after, centres of mass, footprints."""

from functools import cached_property

import numpy as np

from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.kinematics import body_poses, centre_of_mass, clip_sole_points, joint_poses
from eval.clean.edits import FEET
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningSession
from eval.studio.scene.mesh_poses import bone_poses
from eval.studio.state.contact_bars import ContactTrack


class ClipTracks:
    """Tracks of a clip; those that are seldom drawn are computed when they are first asked for.

    Attributes:
        session: Recording.
        result: Result of cleaning, None before the first.
        before: Clip as recorded, T frames at 60 fps.
        after: Cleaned clip; the recorded one before the first cleaning.
    """

    def __init__(self, session: CleaningSession, result: CleaningResult | None) -> None:
        """Take a recording and what came of it."""
        self.session, self.result = session, result
        self.before: BodyMotion = session.recorded
        self.after: BodyMotion = result.after if result else session.recorded

    @cached_property
    def centres(self) -> np.ndarray:
        """Centre of mass before and after [m], shape (2, T, 3)."""
        return np.stack([_centres_of_mass(self.before), _centres_of_mass(self.after)])

    @cached_property
    def joints_before(self) -> np.ndarray:
        """Joints of the performer as recorded, in the humanoid's world [m], shape (F, J, 3)."""
        return self._joints(self.session.performer.motion)

    @cached_property
    def joints_after(self) -> np.ndarray:
        """Joints of the performer after cleaning, in the humanoid's world [m], shape (F, J, 3)."""
        shown = self.result.shown_output() if self.result else None
        return self._joints(shown) if shown else self.joints_before

    @cached_property
    def bones_before(self) -> tuple[np.ndarray, np.ndarray]:
        """Places (F, B, 3) [m] and rotations (F, B, 4) of the bones that carry the performer's mesh, as recorded."""
        return self._bones(self.session.performer.motion)

    @cached_property
    def bones_after(self) -> tuple[np.ndarray, np.ndarray]:
        """Places (F, B, 3) [m] and rotations (F, B, 4) of the same after cleaning."""
        shown = self.result.shown_output() if self.result else None
        return self._bones(shown) if shown else self.bones_before

    @cached_property
    def footprints(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places (N, 3) [m], headings (N,) [rad] and feet (N,) of the cleaned clip's contacts."""
        soles = clip_sole_points(self.after)  # (T, 2, 3, 3)
        places, headings, feet = [], [], []
        if self.result:
            track = ContactTrack(self.result.contacts, self.result.start_s)
            for foot, name in enumerate(FEET):
                for bar in track.bars(name):
                    heel, ball = np.median(soles[bar.start : bar.stop, foot, :2], axis=0)
                    places.append([*(0.5 * (heel + ball))[:2], 0.0])
                    headings.append(np.arctan2(ball[1] - heel[1], ball[0] - heel[0]))
                    feet.append(foot)
        return np.reshape(places, (-1, 3)), np.array(headings), np.array(feet, dtype=int)

    def _bones(self, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        mesh = self.session.bvh.stated.mesh
        assert mesh
        return bone_poses(self.session, motion, mesh)

    def _joints(self, motion: Motion) -> np.ndarray:
        def block(part: slice) -> tuple[np.ndarray, ...]:
            positions, _ = joint_poses(motion.cut(part.start, part.stop))
            return (self.session.retargeted.to_humanoid_world(positions).astype(np.float32),)

        return by_blocks(block, len(motion))[0]


def _centres_of_mass(motion: BodyMotion) -> np.ndarray:
    return by_blocks(lambda part: (centre_of_mass(*body_poses(motion.cut(part.start, part.stop))),), len(motion))[0]
