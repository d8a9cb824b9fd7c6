"""Rows of the virtual users: every network, six-point tracking and the truth, by user (Table 3, figure 6, section 4.2)."""

from collections.abc import Callable, Iterator, Sequence

from datasets.trackers.trackers import TrackerPoses
from eval.study.lobstr.evaluate import simulate_six_point
from eval.study.lobstr.evaluation_sessions import Session
from eval.study.lobstr.scores import PredictedLegs, Scores, score_sessions
from eval.study.lobstr.variants import LOST_FEET, PERFECT_FEET, POSITIONS_SUFFIX, TABLE_3, TRUTH, USER_HEIGHTS_CM, user_row


class UserRows:
    """Gathers the measures of the users, seed by seed."""

    def __init__(self, sessions: Sequence[Session]) -> None:
        """Score six-point tracking and the truth on the users' sessions."""
        self._sessions = {height: [one for one in sessions if one.height_cm == height] for height in USER_HEIGHTS_CM}
        self._hidden = {}
        self._found: dict[tuple[int, str], list[Scores]] = {}
        for height, own in self._sessions.items():
            lost, self._hidden[height] = simulate_six_point(own, lost=True)
            self._score(height, PERFECT_FEET, simulate_six_point(own, lost=False)[0])
            self._score(height, LOST_FEET, lost)
            self._score(height, TRUTH, [PredictedLegs(one.clip.legs) for one in own])

    def add(self, how: str, predict: Callable[[Sequence[TrackerPoses]], Sequence[PredictedLegs]], toe_error_cm: float) -> None:
        """Score one seed of a network, its state carried as live, with rotations compensated alone and with places as well.

        Args:
            how: Name of the network's rows behind the user's.
            predict: Takes the joints' poses in each session; returns the network's legs.
            toe_error_cm: The network's error of toe-bases with perfect trackers, its state carried [cm].
        """
        for height, own in self._sessions.items():
            for places in (False, True):
                predicted = predict([one.joints(places) for one in own])
                scores = self._score(height, how + POSITIONS_SUFFIX * places, predicted)
                scores["toe_position_growth"] = scores["toe_position_error"] - own[0].size_ratio * toe_error_cm

    def rows(self) -> Iterator[tuple[str, list[Scores], dict[str, float]]]:
        """Yield the name, the seeds and the published values of each row, user by user, networks first."""
        ordered = sorted(self._found.items(), key=lambda one: one[0][1] in (PERFECT_FEET, LOST_FEET, TRUTH))
        for height in USER_HEIGHTS_CM:
            for (whose, how), seeds in ordered:
                if whose == height:
                    yield user_row(height, how), seeds, TABLE_3.get((height, how), {})

    def _score(self, height: int, how: str, predicted: Sequence[PredictedLegs]) -> Scores:
        scores = score_sessions(self._sessions[height], predicted, self._hidden[height])
        self._found.setdefault((height, how), []).append(scores)
        return scores
